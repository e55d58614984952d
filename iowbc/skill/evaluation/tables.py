"""Tables and figure of the skill layer's games: forces and the worst partner first, then success."""

from functools import cache

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from iowbc.arrays import Array, Indices
from iowbc.evaluation.report.figures import draw_bars, finish
from iowbc.evaluation.report.statistics import RESAMPLES, Bootstrapped, bootstrapped, interquartile_mean
from iowbc.results.table import ABSENT, Cell, Table, heads

FORCE, SUCCESS = "partner_force_p90", "success"
UNIT = ["task", "known", "partner", "mass", "episode"]
"""Columns that identify an episode across competitors."""
COLUMNS = {
    FORCE: ("Partner force p90 [N]", ".1f"),
    "partner_work": ("Partner work [J]", ".1f"),
    "internal_force": ("Internal force [N]", ".1f"),
    "path_error": ("Path error [m]", ".3f"),
    "path_error_max": ("largest [m]", ".3f"),
    "tilt": ("Tilt [rad]", ".3f"),
    "load_share": ("Load share", ".2f"),
    "time": ("Time [s]", ".1f"),
}
"""Metrics of an episode with column heading and number format, in table order."""


def tables(games: pd.DataFrame, held_out: tuple[str, ...]) -> list[Table]:
    """All tables. `games`: one row per episode; `held_out`: partners that training does not use."""
    who = np.where(games["partner"].isin(held_out), "held-out partners", "partners of training")
    who = np.where(games["partner"] == "agent", "learnt human", who)
    goal = np.where(games["known"], "both know the goal", "only the human knows")
    by = {
        "skill": (pd.Series(goal, games.index) + ", " + pd.Series(who, games.index), "goal and kind of partner"),
        "skill_partners": (games["partner"] + ", " + pd.Series(goal, games.index), "partner"),
        "skill_tasks": (games["task"] + ", " + pd.Series(goal, games.index), "task"),
    }
    if games.groupby("task")["mass"].nunique().max() > 1:
        loads = games["task"] + games["mass"].map(" {:g} kg".format)
        by["skill_loads"] = (loads, "task and mass")
        by["skill_cells"] = (loads + ", " + by["skill_partners"][0], "task, mass and partner")
    return [_table(name, games, group, kind) for name, (group, kind) in by.items()]


def _table(name: str, games: pd.DataFrame, group: "pd.Series[str]", kind: str) -> Table:
    rows: list[tuple[Cell, ...]] = []
    numbers = []
    for title, within in games.groupby(group, sort=False):
        first = str(games["label"].iloc[0])
        for label, own in within.groupby("label", sort=False):
            found = {"success": estimate(own, SUCCESS, whole=True), "worst": worst_partner(own)}
            found |= {figure: estimate(own, figure) for figure in COLUMNS}
            chance = None if label == first else improvement(within[within["label"] == first], own)
            rows.append(
                (
                    str(title),
                    str(label),
                    str(own["training"].nunique()),
                    str(len(own)),
                    _cell(found[FORCE], ".1f"),
                    f"{found['worst'].value:.1f}",
                    ABSENT if chance is None else _cell(chance, ".2f"),
                    _cell(tuple(100.0 * value for value in found["success"]), ".0f"),
                    *(_cell(found[figure], form) for figure, (_, form) in list(COLUMNS.items())[1:]),
                    f"{int(own['fallen'].sum())} / {int(own['dropped'].sum())}",
                )
            )
            numbers.append({"group": title, "label": label, "episodes": len(own)})
            for figure, one in (found | ({} if chance is None else {"P": chance})).items():
                numbers[-1] |= one.named(figure)
    shown = [head for head, _ in COLUMNS.values()]
    columns = heads(
        *("Games", "Skill", "Trainings", "Episodes", shown[0], "Worst partner [N]", "P", "Success [%]"),
        *shown[1:],
        "Falls / drops",
    )
    caption = (
        f"Games by {kind}: success, and interquartile means over all episodes, with 95 % intervals by bootstrap over "
        "trainings and episodes. Partner force: 90th percentile of the horizontal force of the human within an "
        "episode; worst partner: the greatest such mean of one partner. P: probability that the first skill has the "
        "smaller partner force in the same episode. Partner work: integral of the absolute power of the human beyond "
        "its share. Tilt: largest of an episode; load share: that of the robot. Every skill plays the same "
        "episodes, in simulation."
    )
    return Table(name, caption, columns, rows, pd.DataFrame(numbers))


def estimate(games: pd.DataFrame, figure: str, whole: bool = False) -> Bootstrapped:
    """Interquartile mean, or the mean where `whole`."""
    values = by_training(games, figure)
    drawn = values[_resamples(*values.shape)].reshape(RESAMPLES, -1)

    def mean(rows: Array) -> Array:
        return np.asarray(rows.mean(axis=-1)) if whole else interquartile_mean(rows)

    return bootstrapped(mean(values.ravel()), mean(drawn))


def by_training(games: pd.DataFrame, figure: str) -> Array:
    """A metric by training and episode, (trainings, episodes)."""
    return games.pivot(index="training", columns=UNIT, values=figure).to_numpy(np.float64)


def worst_partner(games: pd.DataFrame) -> Bootstrapped:
    """Highest interquartile mean of the force over partners."""
    found = [estimate(own, FORCE) for _, own in games.groupby("partner")]
    return max(found, key=lambda one: one.value)


def improvement(first: pd.DataFrame, other: pd.DataFrame) -> Bootstrapped:
    """Probability that the first has the smaller force in the same episode; ties count half."""
    own, theirs = by_training(first, FORCE), by_training(other, FORCE)
    wins = (own[:, None] < theirs[None]) + 0.5 * (own[:, None] == theirs[None])
    (ours, episodes), (others, _) = _resamples(*own.shape), _resamples(*theirs.shape, seed=1)
    drawn = wins[ours[..., None], others.swapaxes(1, 2)[..., None], episodes[:, None]].mean(axis=(1, 2, 3))
    return bootstrapped(wins.mean(), drawn)


@cache
def _resamples(trainings: int, units: int, seed: int = 0) -> tuple[Indices, Indices]:
    """Trainings (RESAMPLES, trainings, 1) and episodes (RESAMPLES, 1, units) of each resample, with replacement."""
    generator = np.random.default_rng(seed)
    drawn = [[generator.integers(n, size=n) for n in (trainings, units)] for _ in range(RESAMPLES)]
    chosen, episodes = (np.stack(rows) for rows in zip(*drawn, strict=True))
    return chosen[:, :, None], episodes[:, None, :]


def _cell(ends: tuple[float, ...], form: str) -> Cell:
    value, low, high = (f"{end:{form}}" for end in ends)
    return value if low == high else f"{value} ({low} to {high})"


def headline(games: pd.DataFrame) -> dict[str, float]:
    """Force, worst partner and success of each competitor, by whether both or only the human know the path."""
    found: dict[str, float] = {}
    for (label, known), own in games.groupby(["label", "known"], sort=False):
        name = f"{label}/{'known' if known else 'human_only'}".replace(" ", "_")
        found[f"{name}/partner_force_p90"] = float(interquartile_mean(own[FORCE].to_numpy(np.float64)))
        found[f"{name}/worst_partner"] = worst_partner(own).value
        found[f"{name}/success"] = float(own[SUCCESS].mean())
    return found


def figure(games: pd.DataFrame) -> Figure:
    """Force and success by partner and by whether the robot knows the path."""
    labels, titles = list(dict.fromkeys(games["label"])), {FORCE: "partner force p90 [N]", SUCCESS: "success [share]"}
    kinds = [known for known in (True, False) if known in set(games["known"])]
    drawing = Figure(figsize=(11.0, 3.2 * len(kinds)), layout="constrained")
    grid = drawing.subplots(len(kinds), 2, squeeze=False)
    for axes, known in zip(grid, kinds, strict=True):
        partners = list(dict.fromkeys(games[games["known"] == known]["partner"]))
        for panel, (name, title) in zip(axes, titles.items(), strict=True):
            heights, intervals = {}, {}
            for label in labels:
                own = games[(games["label"] == label) & (games["known"] == known)]
                found = [estimate(own[own["partner"] == partner], name, name == SUCCESS) for partner in partners]
                value, low, high = np.array(found).T
                heights[label], intervals[label] = value, np.stack([value - low, high - value])
            draw_bars(panel, heights, dict.fromkeys(labels, [""] * len(partners)), partners, intervals)
            panel.set_title(f"{title}, {'both know the goal' if known else 'only the human knows the goal'}")
    return finish(drawing, list(grid.flat), "", grid[0][0])
