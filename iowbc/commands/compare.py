"""`iowbc compare` and `iowbc report`: tables, figures, learning curves and films over several runs."""

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from rich.filesize import decimal
from typer import Argument, Option

from iowbc.commands import completion, options
from iowbc.commands.diff import difference_lines
from iowbc.commands.lookup import COMPARED, FILM, film_of, members_of, named, points_of, start_comparison
from iowbc.commands.playable import evaluated_actor
from iowbc.commands.printed import film_progress, print_json, shown_path, stdout_console, tell
from iowbc.commands.results import PROBE, TRIALS, split_tables
from iowbc.errors import UsageError
from iowbc.files import data_digest
from iowbc.pipeline.console.display import sparkline
from iowbc.pipeline.console.wording import KEY_LENGTH
from iowbc.pipeline.store.last_used import require_whole
from iowbc.pipeline.store.locks import lock_path, named_lock
from iowbc.pipeline.store.runs import Runs, require_writable
from iowbc.pipeline.store.store import Store
from iowbc.report.runs import Group, Run, grouped, metrics_table, trainings_table
from iowbc.results.table import Table, drawn, markdown, read_tables, write_table
from iowbc.stages.registry import STAGES

if TYPE_CHECKING:
    import pandas as pd

    from iowbc.report.curves import CurvePanel

CURVE_WIDTH = 40
"""Characters of a learning curve."""
LONGEST_NAME = 100
"""Characters of the names in a report's file name."""


def compare(
    words: Annotated[
        list[str],
        Argument(help="Two or more finished recipes, or a study.", metavar="RECIPE...", autocompletion=completion.ran),
    ],
    output: Annotated[Path | None, Option(help="Output folder (default: runs/compare).")] = None,
    film: Annotated[bool, Option("--film", help="Also record a film of one trial, all recipes side by side.")] = False,
    as_json: options.AsJson = False,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Write `metrics.md`, learning curves, and the report over all trials, under `output`; print the tables. Of a
    study, compare the finished recipes. Raises `UsageError`."""
    store = Store(Runs(runs))
    found = _recipes(store, words, "compare")
    study = next((word for word in words if members_of(word)), "")
    if len(found) < 2 and not study:
        raise UsageError("compare needs two or more recipes, for example `iowbc compare full wbc`")
    options.require_extra("train", "iowbc compare")
    write_comparison(store, found, output or store.runs.compared / Path(study).stem, study, film=film, as_json=as_json)


def write_comparison(
    store: Store, found: Sequence[Run], output: Path, study: str = "", *, film: bool = False, as_json: bool = False
) -> None:
    """Compare runs under `output`, and print the tables; `study`: the study whose variants they are."""
    console, tried = stdout_console(), _having(found, TRIALS)
    require_writable(output, "--output")
    if film and len(tried) < 2:
        raise UsageError("--film shows evaluated runs side by side: two or more must have finished the stage eval")
    require_whole(store.runs, (artifact for run in found for artifact in run.artifacts.values()))
    missing = [name for name in members_of(study) if name not in {run.label for run in tried}]
    if tried:
        missing += [run.label for run in found if "eval" not in run.artifacts and run.label not in missing]
    metrics = metrics_table(grouped(found))
    with named_lock(lock_path(store.runs, f"compare-{data_digest(str(output.resolve()))[:KEY_LENGTH]}")):
        start_comparison([run.label for run in found], output)
        (output / "metrics.md").write_text(markdown(metrics), encoding="utf-8")
        report_joint(found, output, missing, least=1 if study else 2)
        if film:
            _film(store, console, tried, output / FILM, quiet=as_json)
        curves, tables = _learning_curves(found, output), read_tables(output / "tables")
    if as_json:
        rows = [
            {"stage": stage, "run": run.label, **artifact.metrics}
            for run in found
            for stage, artifact in run.artifacts.items()
        ]
        files = [path for part in (output, *(output / name for name in COMPARED)) for path in part.glob("*.*")]
        print_json(console, {"metrics": rows, "files": [shown_path(path) for path in sorted(files)]})
        return
    for table in (metrics, *tables):
        console.print(drawn(table, console.width) if table.rows else "no metric differs")
        console.print()
    _print_curves(curves, console)
    if missing:
        text = f"not compared, for their eval has not run: {', '.join(missing)}"
        tell(console, f"{text}; `iowbc plan {study or missing[0]}` says how long that takes")
    for path in (path for path in sorted(output.iterdir()) if path.is_file()):
        tell(console, shown_path(path))
    for part in (output / name for name in COMPARED):
        if count := sum(1 for _ in part.rglob("*.*")):
            tell(console, f"{shown_path(part)}/ ({count} file{'s' if count != 1 else ''})")


def report(
    words: Annotated[
        list[str],
        Argument(help="One or more finished recipes.", metavar="RECIPE...", autocompletion=completion.ran),
    ],
    output: Annotated[Path | None, Option(help="Output HTML file (default: runs/report/RECIPE.html).")] = None,
    log: Annotated[
        Path | None,
        Option(help="Replay and plot this log of `iowbc robot RECIPE` instead (default output: MCAP.png)."),
    ] = None,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Write one self-contained HTML file about runs, readable offline. Raises `UsageError`."""
    store, console = Store(Runs(runs)), stdout_console()
    if log is not None:
        if len(words) > 1:
            raise UsageError("--log: name only the recipe whose export wrote it")
        from iowbc.commands.robot_log import report_log

        report_log(console, words[0], log, output or log.with_suffix(".png"))
        return
    name = "-".join(Path(word).stem for word in words)
    name = name if len(name) <= LONGEST_NAME else f"{Path(words[0]).stem}-and-{len(words) - 1}-others"
    output = output or store.runs.reports / f"{name}.html"
    found = _recipes(store, words, "report")
    if output.suffix != ".html" or output.is_dir():
        raise UsageError(f"--output {output}: a report is an HTML file; give the name of a file that ends in .html")
    options.require_extra("train", "iowbc report")
    require_writable(output.parent, "--output")
    require_whole(store.runs, (artifact for run in found for artifact in run.artifacts.values()))

    from iowbc.report.page import write_page

    differences = [
        line
        for other in found[1:]
        for line in (f"{found[0].label} → {other.label}", *(f"  {text}" for text in difference_lines(found[0], other)))
    ]
    tables, media = _joined(store, found)
    write_page(output, found, *split_tables(tables), differences, media)
    tell(console, f"{shown_path(output)} ({decimal(output.stat().st_size)}): open it in any browser, no network needed")


def _recipes(store: Store, words: Sequence[str], command: str) -> list[Run]:
    """The runs that the words name. Raises `UsageError` for an artifact."""
    found = [named(store, word) for word in points_of(store, words)]
    for run in found:
        if not run.recipe:
            text = f"{command} takes recipes that have run, as `iowbc status` lists them"
            raise UsageError(f"{run.label} is one artifact; {text}")
    return found


def _joined(store: Store, found: Sequence[Run]) -> tuple[list[Table], dict[str, bytes]]:
    """Result tables of one run, or over all trials of several; also their joint figures and film by file name."""
    evaluated = [run.artifacts["eval"] for run in found if "eval" in run.artifacts]
    if len(evaluated) < 2:
        return [table for one in evaluated for table in read_tables(one.folder / "tables")], {}
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder)
        report_joint(found, output)
        film = film_of(store.runs, [run.label for run in found])
        media = [*sorted((output / "figures").glob("*.png")), *([film] if film else [])]
        return read_tables(output / "tables"), {path.name: path.read_bytes() for path in media}


def _learning_curves(found: Sequence[Run], output: Path) -> "dict[str, list[CurvePanel]]":
    """The main learning curves of all recipes by stage; also drawn under `output`, a picture a stage."""
    from iowbc.report.curves import PICTURE_POINTS, learning_figure, learning_panels
    from iowbc.results.picture import write_figure

    groups = grouped(found)
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


def _having(runs: Sequence[Run], name: str) -> list[Run]:
    """The runs whose evaluation left a file of this name."""
    return [run for run in runs if "eval" in run.artifacts and (run.artifacts["eval"].folder / name).is_file()]


def _with_unique_labels(
    runs: Sequence[Run], name: str, together: bool = True
) -> "tuple[list[pd.DataFrame], dict[str, str]]":
    """A table of each run's evaluation with unique names of variants, and the labels of those named after their first
    run instead. Runs that differ only in their seed are trainings of one variant, unless `together` is false."""
    import pandas as pd

    from iowbc.evaluation.report.aggregate import TRAINING
    from iowbc.evaluation.report.columns import STANDS_STILL

    tables = {run.label: pd.read_parquet(run.artifacts["eval"].folder / name) for run in runs}
    groups = grouped(runs) if together else [Group(run.label, (run,)) for run in runs]
    own = [str(tables[group.runs[0].label]["variant"].iloc[0]) for group in groups]
    labels: dict[str, str] = {}
    for group, label in zip(groups, own, strict=True):
        taken = {other.runs[0].label for other in groups if other is not group} | {STANDS_STILL}
        called = label if own.count(label) == 1 and label not in taken else group.runs[0].label
        labels |= {} if called == label else {called: label}
        for run, seed in zip(group.runs, group.seeds, strict=True):
            tables[run.label] = tables[run.label].assign(variant=called, **{TRAINING: seed})
    return [tables[run.label] for run in runs], labels


def report_joint(found: Sequence[Run], output: Path, missing: Sequence[str] = (), least: int = 1) -> None:
    """Write tables and figures over all trials of the runs, a shared evaluation once, if `least` runs or more have any;
    also of all probed runs: how well the object's mass can be read from their histories. `missing`: recipes that have
    no evaluation. Raises `UsageError` where the runs count masses differently."""
    import pandas as pd

    from iowbc.evaluation.report.probe import write_probe
    from iowbc.evaluation.report.report import write_report

    if probed := _having(found, PROBE):
        write_probe(pd.concat(_with_unique_labels(probed, PROBE, together=False)[0], ignore_index=True), output)
    if len(tried := _having(found, TRIALS)) < least:
        return
    first = dict[Path, Run]()
    for run in tried:
        first.setdefault(run.artifacts["eval"].folder, run)
    runs = [*first.values()]
    trials, labels = _with_unique_labels(runs, TRIALS)
    rates = {run.artifacts["eval"].recipe["eval"]["success"]["capacity_rate"] for run in runs}
    if len(rates) > 1:
        raise UsageError(
            f"the recipes count a mass as carried at different rates (eval.success.capacity_rate): {rates}"
        )
    write_report(pd.concat(trials, ignore_index=True), output, float(rates.pop()), labels)
    write_table(trainings_table(grouped(runs), missing), output / "tables")


def film_joint(store: Store, console: Console, runs: Sequence[Run], output: Path) -> None:
    """Film a trial that two or more evaluated runs share, unless there is a newer film; print its path or why not."""
    tried, film = _having(runs, TRIALS), output / FILM
    if len(tried) < 2:
        return
    newest = max((run.artifacts["eval"].folder / TRIALS).stat().st_mtime for run in tried)
    try:
        if not (film.is_file() and film.stat().st_mtime > newest):
            _film(store, console, tried, film)
        tell(console, shown_path(film))
    except UsageError as reason:
        tell(console, f"no film: {reason}")


def _film(store: Store, console: Console, tried: Sequence[Run], path: Path, quiet: bool = False) -> None:
    """Film a trial that all share side by side, with the first training of each recipe, or all of a single recipe."""
    from iowbc.evaluation.films import common_trial, film_side_by_side

    first = [group.runs[0].label for group in grouped(tried)]
    progress = film_progress(console, None if quiet else path)
    actors = [
        evaluated_actor(store, run.artifacts["eval"], table)
        for run, table in zip(tried, _with_unique_labels(tried, TRIALS)[0], strict=True)
        if len(first) == 1 or run.label in first
    ]
    if not (rows := common_trial(actors)):
        raise UsageError("the runs share no trial to film: their evaluations have no suite and mass in common")
    film_side_by_side(actors, rows, path, progress=progress)
