"""Learning curves: one line of JSON per update beside the checkpoint, a table, and a figure with units in titles."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from iowbc.files import write_whole
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


TITLES = {
    "episode_seconds": "length of an episode [s]",
    "terminations/fallen": "episodes that end in a fall [share]",
    "episode_return": "reward of an episode",
    "terminations/dropped": "episodes that end in a drop [share]",
    "terminations/diverged": "episodes that diverge [share]",
    "terminations/lagging": "episodes that end for lagging [share]",
    "terminations/time_limit": "episodes that reach their end [share]",
    "tracking": "tracking of the command [share of the best]",
    "infeasible_pushes": "infeasible pushes [share]",
    "divergences": "simulations that diverged",
    "rollbacks": "returns to the best policy since it improved",
    "reward": "reward [1/s]",
    "curriculum_level": "level, mean of all axes",
    "check/score": "score of the check",
    "check/survived": "trials of the check survived [share]",
    "check/succeeded": "trials of the check that succeed [share]",
    "check/upright": "time upright in the check [share]",
    "check/weight_in_hands": "weight in the hands in the check [share]",
    "check/transport": "way covered in the check [share]",
    "check/E_v": "E_v in the check [m/s]",
    "check/E_psi": "E_ψ in the check [rad]",
    "check/E_alpha": "E_α in the check [rad]",
    "check/E_h": "E_h in the check [m]",
    "train/kl": "KL divergence of an update [nat]",
    "train/approx_kl": "KL divergence of an update, sampled [nat]",
    "train/policy_loss": "loss of the policy",
    "train/value_loss": "loss of the value",
    "train/clip_share": "samples clipped [share]",
    "train/learning_rate": "learning rate",
    "train/imitation_error": "difference from the scripted leader's action",
    "train/imitation_scale": "size of the scripted leader's action",
    "train/std": "standard deviation of the action",
    "train/explained_variance": "variance explained by the value [share]",
    "train/gain": "advantage gained by an update, on the next rollout",
    "steps_per_second": "environment steps a second [1/s]",
    "kl": "KL divergence from the teacher [nat]",
    "kl_at_shared_std": "KL divergence at the teacher's std [nat]",
    "auxiliary_error": "mean squared error of what is read from the latent",
    "std": "standard deviation of the student",
    "action_rmse": "difference from the teacher's action",
    "action_agreement": "agreement with the teacher [share]",
    "teacher_share": "environments that the teacher drives [share]",
}
"""Titles by the name of the recorded quantity."""
FAMILIES = {
    "robot/": "{} of the robot's skill",
    "human/": "{} of the human's policy",
    "scripted/": "{}, scripted humans",
    "learnt/": "{}, learnt human",
    "level/": "level of {}",
    "falls/": "falls, {} [share of episodes]",
    "reward/": "reward of {} [1/s]",
    "seconds/": "time of an update, {} [s]",
}
"""Titles by name prefix; the rest of the name replaces the braces."""
ERROR_UNITS = {"velocity": "m/s", "heading": "rad", "height": "m", "pitch": "rad"}
"""Units of `error/<scene>/<standing or walking>/<error>`."""


def title_of(name: str) -> str:
    """Title of a panel; the name itself if it is not listed."""
    family, _, rest = name.partition("/")
    if family == "error" and rest.count("/") == 2:
        scene, kind, error = rest.split("/")
        return f"error of {error}, {scene}, {kind} [{ERROR_UNITS.get(error, '?')}]"
    load, _, figure = rest.rpartition("/")
    if family == "check" and f"check/{figure}" in TITLES and load:
        return f"{TITLES[f'check/{figure}']}, {load.replace('_', ' ')}"
    for beginning, title in FAMILIES.items():
        if name.startswith(beginning):
            return title.format(name.removeprefix(beginning))
    return TITLES.get(name, name)
