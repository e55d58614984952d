"""`iowbc compare`: the tables and figures of the evaluation over several runs, and their metrics side by side."""

import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from iowbc.commands.filming import Filming
from iowbc.commands.members import FILM, film_of, members_of, points_of, record_comparison
from iowbc.commands.named import Named, named
from iowbc.commands.origins import PROBE, TRIALS, evaluated_actor, tables_of
from iowbc.commands.printed import print_json, shown_path, tell
from iowbc.commands.training import require_training
from iowbc.commands.trainings import trainings_table
from iowbc.errors import UsageError
from iowbc.pipeline.console.live_table import sparkline
from iowbc.pipeline.store.last_used import require_whole
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.writability import require_writable
from iowbc.results.table import Table, drawn, markdown, read_tables, write_table
from iowbc.stages.registry import STAGES

if TYPE_CHECKING:
    import pandas as pd

    from iowbc.report.curves import CurvePanel
    from iowbc.report.runs import Group

CURVE_WIDTH = 40
"""Characters of a learning curve."""


def compare(
    store: Store,
    console: Console,
    words: Sequence[str],
    output: Path | None = None,
    film: bool = False,
    as_json: bool = False,
) -> None:
    """Write `metrics.md`, learning curves, and the report over all trials, under `output`; print the tables.

    words: runs, two or more, or a recipe of recipes, of which those are compared that have finished. output: empty for
    a folder of `runs/compare/`. film: also play one trial that all share again, and show the runs side by side. Raises
    `UsageError`.
    """
    from iowbc.report.runs import metrics_table

    found = [named(store, word) for word in points_of(store, words)]
    members = [name for word in words for name in members_of(word)]
    if len(found) < 2 and not members:
        raise UsageError("compare needs two or more recipes, for example `iowbc compare full wbc`")
    output = output or (store.runs.compared / Path(words[0]).stem if members else store.runs.compared)
    require_training("compare")
    require_writable(output, "--output")
    require_whole(store.runs, (run.artifacts["eval"] for run in found if "eval" in run.artifacts))
    record_comparison([run.word for run in found], output)
    metrics = metrics_table(_groups(found))
    (output / "metrics.md").write_text(markdown(metrics), encoding="utf-8")
    tried = _having(found, TRIALS)
    missing = [name for name in members if name not in {run.word for run in tried}]
    _report_probes(_having(found, PROBE), output)
    if len(tried) > 1 or (tried and members):
        trials = report_together(tried, output, missing)
    if film and len(tried) > 1:
        with Filming(console, None if as_json else output / FILM) as filming:
            _film(store, *_of_each_recipe(tried, trials), output / FILM, filming)
    elif film:
        raise UsageError("--film shows evaluated runs side by side: two or more must have finished the stage eval")
    curves = _learning_curves(found, output)
    if as_json:
        print_json(console, _data(found, output))
        return
    for table in (metrics, *read_tables(output / "tables")):
        console.print(drawn(table, console.width) if table.rows else "no metric differs")
        console.print()
    _print_curves(curves, console)
    if missing:
        text = f"not compared, for their eval has not run: {', '.join(missing)}; `iowbc plan {words[0]}` says how long "
        tell(console, f"{text}that takes")
    for text in _written(output):
        tell(console, text)


def _written(output: Path) -> list[str]:
    """A line for each file of a comparison, and one for each folder in it."""
    folders = {path: sum(1 for _ in path.rglob("*.*")) for path in sorted(output.iterdir()) if path.is_dir()}
    files = [shown_path(path) for path in sorted(output.glob("*.*"))]
    counts = {path: f"{count} file{'s' if count != 1 else ''}" for path, count in folders.items()}
    return [*files, *(f"{shown_path(path)}/ ({count})" for path, count in counts.items())]


def _data(found: Sequence[Named], output: Path) -> dict[str, Any]:
    """The same for other programs: every metric of every run, and the files that were written."""
    metrics = [
        {"stage": stage, "run": run.word, **artifact.metrics}
        for run in found
        for stage, artifact in run.artifacts.items()
    ]
    return {"metrics": metrics, "files": [shown_path(path) for path in sorted(output.rglob("*.*"))]}


def _groups(found: Sequence[Named]) -> "list[Group]":
    from iowbc.report.runs import Run, grouped

    return grouped([Run(run.word, run.artifacts, run.recipe or {}) for run in found])


def _learning_curves(found: Sequence[Named], output: Path) -> "dict[str, list[CurvePanel]]":
    """The main learning curves of all recipes by stage; also drawn under `output`, a picture a stage."""
    from iowbc.report.curves import PICTURE_POINTS, learning_figure, learning_panels
    from iowbc.results.picture import write_figure

    groups = _groups(found)
    curves = {stage: panels for stage in STAGES if (panels := learning_panels(groups, stage, PICTURE_POINTS)[0])}
    for stage, panels in curves.items():
        write_figure(learning_figure(panels, stage), output / "figures" / f"learning_{stage}.png")
    return curves


def _print_curves(curves: "Mapping[str, Sequence[CurvePanel]]", console: Console) -> None:
    """The main learning curves of each recipe, one line each; `iowbc report` has them to look into."""
    for stage, panels in curves.items():
        for panel in panels:
            console.print(f"{stage}: {panel.title}", markup=False, highlight=False)
            for curve in panel.curves:
                if values := [value for value in curve.mean.tolist() if math.isfinite(value)]:
                    text = f"  {sparkline(values, CURVE_WIDTH)} {values[-1]:.4g}  {curve.label}"
                    console.print(text, markup=False, highlight=False, no_wrap=True, overflow="ellipsis")


@dataclass(frozen=True)
class Joined:
    """What an evaluation, or several together, show."""

    tables: list[Table]
    media: dict[str, bytes]
    """Pictures of several together, and a film of them side by side where there is one, by file name."""


def joined(store: Store, found: Sequence[Named]) -> Joined:
    """The result tables of one run; of several those over all their trials, with their pictures and film."""
    evaluated = [run.artifacts["eval"] for run in found if "eval" in run.artifacts]
    if len(evaluated) < 2:
        return Joined([table for one in evaluated for table in tables_of(one)], {})
    with tempfile.TemporaryDirectory() as folder:
        output, tried = Path(folder), _having(found, TRIALS)
        _report_probes(_having(found, PROBE), output)
        if len(tried) > 1:
            report_together(tried, output)
        film = film_of(store.runs, [run.word for run in found])
        media = [*sorted((output / "figures").glob("*.png")), *([film] if film else [])]
        return Joined(read_tables(output / "tables"), {path.name: path.read_bytes() for path in media})


def film_together(store: Store, console: Console, words: Sequence[str], output: Path) -> Path | None:
    """Film a trial that all evaluated runs share, unless there is such a film that is newer than they are.

    None where fewer than two were evaluated. Raises `UsageError` where they share no trial, NoRenderer where nothing
    can be drawn.
    """
    tried = _having([named(store, word) for word in words], TRIALS)
    film = output / FILM
    if len(tried) < 2:
        return None
    newest = max((run.artifacts["eval"].folder / TRIALS).stat().st_mtime for run in tried)
    if not (film.is_file() and film.stat().st_mtime > newest):
        with Filming(console, film) as filming:
            _film(store, *_of_each_recipe(tried, _told_apart(tried, TRIALS)[0]), film, filming)
    return film


def _of_each_recipe(
    runs: Sequence[Named], trials: "Sequence[pd.DataFrame]"
) -> "tuple[list[Named], list[pd.DataFrame]]":
    """The first training of each recipe with its trials; all of them where there is one recipe."""
    first = [group.runs[0].label for group in _groups(runs)]
    chosen = [place for place, run in enumerate(runs) if len(first) == 1 or run.word in first]
    return [runs[place] for place in chosen], [trials[place] for place in chosen]


def _having(runs: Sequence[Named], name: str) -> list[Named]:
    """The runs whose evaluation left a file of this name."""
    return [run for run in runs if "eval" in run.artifacts and (run.artifacts["eval"].folder / name).is_file()]


def _told_apart(runs: Sequence[Named], name: str, together: bool = True) -> "tuple[list[pd.DataFrame], dict[str, str]]":
    """A table of each run's evaluation, and the labels of variants that go by another name.

    Runs that differ in their seed alone are trainings of one variant, unless `together` is false; a variant is called
    by its first run where another one has its label.
    """
    import pandas as pd

    from iowbc.evaluation.report.aggregate import TRAINING

    tables = {run.word: pd.read_parquet(run.artifacts["eval"].folder / name) for run in runs}
    groups = _groups(runs) if together else [group for run in runs for group in _groups([run])]
    own = [str(tables[group.runs[0].label]["variant"].iloc[0]) for group in groups]
    labels: dict[str, str] = {}
    for group, label in zip(groups, own, strict=True):
        called = label if own.count(label) == 1 else group.runs[0].label
        labels |= {} if called == label else {called: label}
        for run, seed in zip(group.runs, group.seeds, strict=True):
            tables[run.label] = tables[run.label].assign(variant=called, **{TRAINING: seed})
    return [tables[run.word] for run in runs], labels


def _report_probes(runs: Sequence[Named], output: Path) -> None:
    """What the histories of all runs that were probed know of the load."""
    import pandas as pd

    from iowbc.evaluation.report.probe import write_probe

    if runs:
        write_probe(pd.concat(_told_apart(runs, PROBE, together=False)[0], ignore_index=True), output)


def report_together(runs: Sequence[Named], output: Path, missing: Sequence[str] = ()) -> "list[pd.DataFrame]":
    """Write tables and figures over all trials under `output`; the trials of each run.

    missing: recipes that belong to them and have not run. Raises `UsageError` where the runs count masses differently.
    """
    import pandas as pd

    from iowbc.evaluation.report.report import write_report

    trials, labels = _told_apart(runs, TRIALS)
    rates = {run.artifacts["eval"].recipe["eval"]["success"]["capacity_rate"] for run in runs}
    if len(rates) > 1:
        raise UsageError(
            f"the recipes count a mass as carried at different rates (eval.success.capacity_rate): {rates}"
        )
    write_report(pd.concat(trials, ignore_index=True), output, float(rates.pop()), labels)
    write_table(trainings_table(_groups(runs), missing), output / "tables")
    return trials


def _film(store: Store, runs: Sequence[Named], trials: "Sequence[pd.DataFrame]", path: Path, filming: Filming) -> None:
    """Play one trial that all runs share again, with the policies that were evaluated, and film it."""
    from iowbc.evaluation.side_by_side import common_trial, film_side_by_side

    actors = [evaluated_actor(store, run.artifacts["eval"], table) for run, table in zip(runs, trials, strict=True)]
    rows = common_trial(actors)
    if not rows:
        raise UsageError("the runs share no trial to film: their evaluations have no suite and mass in common")
    film_side_by_side(actors, rows, path, progress=filming)
