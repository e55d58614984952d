"""What commands print for other programs with `--json`: one JSON document on standard output."""

import json
import math
from collections.abc import Mapping
from typing import Any

from rich.console import Console

from iowbc.commands.results import shown_path
from iowbc.pipeline.store.artifact import Artifact


def print_json(console: Console, data: Any) -> None:
    """Print data as JSON; what is no number is null."""
    text = json.dumps(_finite(data), indent=2, ensure_ascii=False)
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def artifact_data(artifact: Artifact) -> dict[str, Any]:
    """What an artifact is."""
    manifest = artifact.manifest
    return {
        "stage": manifest.stage,
        "key": manifest.key,
        "version": manifest.version,
        "content": manifest.digest,
        "recipe": manifest.recipe,
        "folder": shown_path(artifact.folder),
        "published": artifact.published,
        "made": manifest.made,
        "seconds": manifest.seconds,
        "attempts": manifest.attempts,
        "workers": manifest.workers,
        "host": manifest.host,
        "bytes": artifact.size,
        "files": {name: record.size for name, record in manifest.files.items()},
        "versions": manifest.versions,
        "metrics": artifact.metrics,
    }


def _finite(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {str(name): _finite(value) for name, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
