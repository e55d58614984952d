"""`iowbc report A [B …]`: one HTML file about a run or several, which opens anywhere without a network."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from iowbc.commands.compare import joined
from iowbc.commands.diff import difference_lines
from iowbc.commands.members import points_of
from iowbc.commands.named import Named, named
from iowbc.commands.results import shown_path, split_tables
from iowbc.commands.training import require_training
from iowbc.errors import UsageError
from iowbc.pipeline.console.wording import size
from iowbc.pipeline.store.last_used import require_whole
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.writability import require_writable


def report(store: Store, console: Console, words: Sequence[str], output: Path) -> None:
    """Write the page about what the words name, and say where it lies. Raises `UsageError`."""
    found = [named(store, word) for word in points_of(store, words)]
    single = [run.word for run in found if run.recipe is None]
    if single:
        raise UsageError(
            f"{single[0]} is one artifact; report takes recipes that have run, as `iowbc status` lists them"
        )
    if output.suffix != ".html":
        raise UsageError(f"--output {output}: a report is an HTML file; give a name that ends in .html")
    require_training("report")
    require_writable(output.parent, "--output")
    require_whole(store.runs, (artifact for run in found for artifact in run.artifacts.values()))

    from iowbc.report.page import write_page
    from iowbc.report.runs import Run, grouped

    runs = [Run(run.word, run.artifacts, run.recipe or {}) for run in found]
    differences = [line for other in found[1:] for line in _differences(found[0], other)]
    together = joined(store, found)
    main, others = split_tables(together.tables)
    write_page(output, runs, grouped(runs), main, others, differences, together.media)
    text = f"{shown_path(output)} ({size(output.stat().st_size)}): open it in any browser, no network needed"
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _differences(first: Named, other: Named) -> list[str]:
    return [f"{first.word} → {other.word}", *(f"  {line}" for line in difference_lines(first, other))]
