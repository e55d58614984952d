"""What to say where the paper's velocity errors of pushes stand beside ours: it does not give their friction."""

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import STAGNATING
from iowbc.evaluation.report.tables import FAILS


def regime(summary: pd.DataFrame, row: pd.Series, error: str = "E_v") -> list[str]:
    """Words beside the paper's `error` at the mass of a row of a summary: that its μ is unknown, and our E_v at the
    same mass where our crates resist so much that they stagnate, as its did. None for other errors, and without load.
    """
    if error != "E_v" or row["kind"] != "pushing" or not row["mass"] > 0:
        return []
    alike = summary[
        (summary["kind"] == "map")
        & (summary["variant"] == row["variant"])
        & (summary["mass"] == row["mass"])
        & (summary["rolling_resistance"] >= STAGNATING)
    ]
    ours = [
        f"{FAILS if np.isnan(one['E_v']) else format(one['E_v'], '.3f')} at μ {one['rolling_resistance']:g}"
        for _, one in alike.iterrows()
    ]
    return ["the paper's μ is unknown", *([f"ours in its regime {', '.join(ours)}"] if ours else [])]
