"""Learning curves: a file with one line of JSON per update beside the checkpoint, a table and a figure."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from iowbc.files import write_whole
from iowbc.learning.curve_titles import title_of
from iowbc.results.table import write_frame

TABLE, FIGURE = "tables/learning_curves.parquet", "figures/learning_curves.png"
"""Paths in an artifact."""
DIGITS = 6
"""Significant digits kept, as in single precision."""
OUTLIERS = (1.0, 99.0)
"""Percentiles of a panel's values that its vertical axis always covers."""
FLATTENED = 10.0
"""A panel is cut if its height exceeds the range between the percentiles by this factor."""
MARGIN = 0.5
"""Space above and below in a cut panel, as a fraction of the range between the percentiles."""


class Curves:
    """Rows of named values by environment step; a resumed training drops the rows after its checkpoint."""

    def __init__(self, path: Path, step: int) -> None:
        self.path = path
        self.rows: list[dict[str, float]] = []
        if path.is_file():
            for line in path.read_bytes().splitlines():
                try:
                    row = json.loads(line)
                except (ValueError, RecursionError):
                    continue
                if _whole(row) and row["step"] <= step:
                    self.rows.append(row)
        write_whole(path, "".join(json.dumps(row) + "\n" for row in self.rows))

    def append(self, step: int, values: Mapping[str, float]) -> None:
        """Add a row; step in environment steps."""
        row = {"step": step, **{name: float(f"{value:.{DIGITS}g}") for name, value in values.items()}}
        self.rows.append(row)
        with self.path.open("a") as file:
            file.write(json.dumps(row) + "\n")

    def write_table(self, path: Path) -> None:
        """Write all rows to a Parquet table in single precision, one column per name; missing values are NaN."""
        import pandas as pd

        table = pd.DataFrame(self.rows, columns=list(dict.fromkeys(name for row in self.rows for name in row)))
        table = table.astype({name: "float32" for name in table.columns if name != "step"})
        write_frame(table, path)

    @staticmethod
    def restore(table: Path, path: Path) -> None:
        """Convert a table of `write_table` back to the file of JSON lines at `path`."""
        import pandas as pd

        again = Curves(path, 0)
        for step, row in pd.read_parquet(table).set_index("step").iterrows():
            again.append(int(step), row.dropna().to_dict())

    def write_figure(self, path: Path, title: str, panels: Sequence[str]) -> None:
        """Plot one panel per name that has values. Panels are cut where outliers would flatten the rest."""
        import numpy as np
        from matplotlib.figure import Figure

        shown = [name for name in panels if any(name in row for row in self.rows)]
        columns = 3
        lines = max(1, -(-len(shown) // columns))
        width, height = 4.0 * columns, 2.6 * lines
        figure = Figure(figsize=(width, height))
        figure.subplots_adjust(0.75 / width, 0.5 / height, 1 - 0.15 / width, 1 - 0.6 / height, wspace=0.24, hspace=0.45)
        figure.suptitle(title, y=1 - 0.1 / height, va="top")
        for position, name in enumerate(shown, 1):
            axes = figure.add_subplot(lines, columns, position)
            points = [(row["step"] / 1e6, row[name]) for row in self.rows if name in row]
            axes.plot(*zip(*points, strict=True), linewidth=1)
            low, high = np.percentile([value for _, value in points], OUTLIERS)
            if np.ptp(axes.get_ylim()) > FLATTENED * (high - low) > 0.0:
                axes.set_ylim(low - MARGIN * (high - low), high + MARGIN * (high - low))
                axes.text(0.98, 0.94, "cut: outliers lie beyond", transform=axes.transAxes, ha="right", fontsize=7)
            axes.set_title(title_of(name), fontsize=9)
            axes.set_xlabel("million environment steps", fontsize=8)
            axes.grid(alpha=0.3)
        figure.savefig(path, dpi=110)

    def write_artifact(
        self, out: Path, title: str, panels: Sequence[str], terms: Sequence[str] = ()
    ) -> dict[str, float]:
        """Write table and figure (`panels`, then `terms`); returns a training stage's metrics, from the last row."""
        for name in (TABLE, FIGURE):
            (out / name).parent.mkdir()
        self.write_table(out / TABLE)
        self.write_figure(out / FIGURE, title, [*panels, *terms])
        last = self.rows[-1] if self.rows else {}
        return {name: last[name] for name in ("step", *panels, "steps_per_second") if name in last}


def _whole(row: Any) -> bool:
    """True if `row` is a complete row: numbers by name, including the step."""
    return isinstance(row, dict) and "step" in row and all(isinstance(value, (int, float)) for value in row.values())
