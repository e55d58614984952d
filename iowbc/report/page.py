"""The report page: one self-contained HTML file without network access."""

import base64
import secrets
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

from iowbc.files import write_whole
from iowbc.learning.curves import FIGURE
from iowbc.pipeline.console.wording import KEY_LENGTH, duration
from iowbc.pipeline.store.artifact import INGREDIENTS, RECIPE, Artifact
from iowbc.report.curves import evaluation_panels, learning_panels
from iowbc.report.runs import Run, grouped, metrics_table
from iowbc.results.table import Table
from iowbc.stages.registry import STAGES

KINDS = {".png": "image/png", ".mp4": "video/mp4"}


def write_page(
    path: Path,
    runs: Sequence[Run],
    tables: Sequence[Table],
    more_tables: Sequence[Table],
    differences: Sequence[str],
    together: Mapping[str, bytes],
) -> None:
    """Write the page about some runs; `more_tables` are folded at first.

    differences: lines that say how the runs differ. together: pictures and films of all of them, by file name.
    """
    from jinja2 import Environment, PackageLoader
    from plotly.offline import get_plotlyjs

    loader = PackageLoader("iowbc.report", "")
    environment = Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    groups = grouped(runs)
    learning = [(name, *learning_panels(groups, name)) for name, stage in STAGES.items() if stage.trained_by]
    text = environment.get_template("page.html").render(
        title=" · ".join(run.label for run in runs),
        made=time.strftime("%Y-%m-%d %H:%M"),
        version=version("iowbc"),
        runs=runs,
        groups=groups,
        metrics=metrics_table(groups).rows,
        tables=tables,
        more_tables=more_tables,
        learning=[entry for entry in learning if entry[1] or entry[2]],
        evaluation=evaluation_panels(groups),
        films=_media(runs, "videos", together, ".mp4"),
        pictures=_media(runs, "figures", together, ".png"),
        first_pictures=[name for stage in STAGES.values() for name in stage.pictures],
        differences=differences,
        provenance=[(run, stage, made, _beside(made)) for run in runs for stage, made in run.artifacts.items()],
        key_shown=KEY_LENGTH,
        duration=duration,
        plotly=get_plotlyjs().replace("</script", "<\\/script"),
        nonce=secrets.token_urlsafe(),
    )
    write_whole(path, text)


def _media(runs: Sequence[Run], folder: str, together: Mapping[str, bytes], kind: str) -> list[tuple[str, str, str]]:
    """Owner, name, and content as a data address of every film or picture, those of all runs first, each artifact once;
    without the picture of the learning curves, which the page draws."""
    found = [("all runs", Path(name), content) for name, content in together.items() if name.endswith(kind)]
    seen = set()
    for run in runs:
        for stage, artifact in run.artifacts.items():
            if artifact.manifest.key not in seen:
                paths = sorted((artifact.folder / folder).glob("*"))
                shown = [path for path in paths if path.suffix in KINDS and path != artifact.folder / FIGURE]
                found += [(f"{run.label}, {stage}", path, path.read_bytes()) for path in shown]
            seen.add(artifact.manifest.key)
    return [
        (owner, path.name, f"data:{KINDS[path.suffix]};base64,{base64.b64encode(content).decode()}")
        for owner, path, content in found
    ]


def _beside(artifact: Artifact) -> list[tuple[str, str]]:
    """The ingredients of the key, and the recipe."""
    paths = [artifact.folder / name for name in (INGREDIENTS, RECIPE)]
    return [(path.name, path.read_text(encoding="utf-8", errors="replace")) for path in paths if path.is_file()]
