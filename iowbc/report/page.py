"""The page itself: one HTML file with everything in it, which asks no network for anything."""

import base64
import secrets
import time
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from iowbc.learning.curves import FIGURE
from iowbc.pipeline.console.wording import KEY_LENGTH, duration
from iowbc.pipeline.store.artifact import INGREDIENTS, RECIPE, Artifact
from iowbc.report.curves import Panel, evaluation_panels, learning_panels
from iowbc.report.runs import Group, Run, metric_rows
from iowbc.stages.registry import STAGES

KINDS = {".png": "image/png", ".mp4": "video/mp4"}


def write_page(
    path: Path,
    runs: Sequence[Run],
    groups: Sequence[Group],
    tables: Sequence[str],
    more_tables: Sequence[str],
    differences: Sequence[str],
    together: Mapping[str, bytes] = MappingProxyType({}),
) -> None:
    """Write the page about some runs.

    tables: result tables in Markdown; more_tables: those that can be unfolded. differences: lines that say how the
    runs differ. together: pictures and films of all of them, by file name.
    """
    from jinja2 import Environment
    from plotly.offline import get_plotlyjs

    template = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(
        files("iowbc.report").joinpath("page.html").read_text(encoding="utf-8")
    )
    curves: dict[str, Panel] = {}
    learning = []
    for stage in (name for name, one in STAGES.items() if one.presentation.trained_by):
        main, others = learning_panels(groups, stage)
        learning.append((stage, _numbered(curves, main), _numbered(curves, others)))
    evaluation = _numbered(curves, evaluation_panels(groups))
    text = template.render(
        title=" · ".join(run.label for run in runs),
        made=time.strftime("%Y-%m-%d %H:%M"),
        version=version("iowbc"),
        runs=runs,
        groups=groups,
        rows=[row for row in metric_rows(groups) if row.differs],
        tables=[_table(markdown) for markdown in tables],
        more_tables=[_table(markdown) for markdown in more_tables],
        learning=[entry for entry in learning if entry[1] or entry[2]],
        evaluation=evaluation,
        films=[*_together(together, ".mp4"), *_media(runs, "videos")],
        pictures=[*_together(together, ".png"), *_media(runs, "figures")],
        first_pictures=[name for stage in STAGES.values() for name in stage.presentation.pictures],
        differences=differences,
        provenance=[(run, stage, made, _beside(made)) for run in runs for stage, made in run.artifacts.items()],
        key_shown=KEY_LENGTH,
        duration=duration,
        curves={name: panel.figure for name, panel in curves.items()},
        plotly=get_plotlyjs().replace("</script", "<\\/script"),
        nonce=secrets.token_urlsafe(),
    )
    path.write_text(text, encoding="utf-8")


def _numbered(curves: dict[str, Panel], panels: Sequence[Panel]) -> list[str]:
    """Names of panels on the page, which are added to its curves."""
    names = [f"curve{len(curves) + place}" for place in range(len(panels))]
    curves.update(zip(names, panels, strict=True))
    return names


def _together(files: Mapping[str, bytes], kind: str) -> Iterator[tuple[str, str, str]]:
    """The same as `_media`, of what shows all runs."""
    for name, content in files.items():
        if name.endswith(kind):
            yield "all runs", name, _address(content, kind)


def _address(content: bytes, kind: str) -> str:
    """A file of a kind as an address that holds it."""
    return f"data:{KINDS[kind]};base64,{base64.b64encode(content).decode()}"


def _media(runs: Sequence[Run], folder: str) -> Iterator[tuple[str, str, str]]:
    """Whose it is, name, and content as a data address of every film or picture, each artifact once.

    The picture of the learning curves is left out: the page draws them.
    """
    seen = set()
    for run in runs:
        for stage, artifact in run.artifacts.items():
            if artifact.manifest.key in seen:
                continue
            seen.add(artifact.manifest.key)
            for path in sorted((artifact.folder / folder).glob("*")):
                if path.suffix in KINDS and path != artifact.folder / FIGURE:
                    yield f"{run.label}, {stage}", path.name, _address(path.read_bytes(), path.suffix)


def _beside(artifact: Artifact) -> list[tuple[str, str]]:
    """What the key was computed from, and the recipe."""
    paths = [artifact.folder / name for name in (INGREDIENTS, RECIPE)]
    return [(path.name, path.read_text(encoding="utf-8", errors="replace")) for path in paths if path.is_file()]


def _table(markdown: str) -> tuple[str, list[list[str]]]:
    """Caption of a Markdown table, and its rows of cells, of which the first is its head."""
    lines = markdown.splitlines()
    caption = next((line.strip("*") for line in lines if line.startswith("*")), "")
    rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines if line.startswith("|")]
    return caption, rows[:1] + rows[2:]
