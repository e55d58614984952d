"""The probe: a ridge regression of the object's mass on what is seen, fitted to some trials and tested on others."""

import numpy as np
import pandas as pd
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import StandardScaler

from iowbc.errors import StageFailed
from iowbc.evaluation.probe.readings import ProbeReadings

PENALTIES = tuple(10.0**power for power in range(6))
"""Of the ridge, on standardised features; the best in cross-validation over the trials that are fitted."""
FOLDS = 4


def inferred_masses(readings: ProbeReadings) -> pd.DataFrame:
    """The mass as it is read in the trials that were not fitted, one row a reading and source.

    Columns: `source` and its `size`, `trial`, `seconds`, `settled` (whether the history was full), `mass` and
    `inferred` [kg]. Trials of even number are fitted, as soon as they have settled, those of odd number tested: no
    regression has seen another reading of the trial that it is tested on. Raises StageFailed where too few trials last.
    """
    tested = readings.trial % 2 == 1
    fitted = ~tested & readings.settled
    lasted = len(np.unique(readings.trial[fitted]))
    if lasted < FOLDS or not (tested & readings.settled).any():
        raise StageFailed(
            f"probe: only {lasted} of the trials to be fitted last as long as a history, {FOLDS} must; train longer, "
            "or give lighter masses (eval.probe.masses) or a longer sequence (eval.probe.sequence)"
        )
    told = {
        "trial": readings.trial[tested],
        "seconds": readings.seconds[tested],
        "settled": readings.settled[tested],
        "mass": readings.mass[tested],
    }
    tables = []
    for source, given in readings.features.items():
        features = given.astype(np.float64)  # a history's columns are nearly alike: single precision is not enough
        search = GridSearchCV(
            Pipeline([("scale", StandardScaler()), ("ridge", Ridge())]),
            {"ridge__alpha": PENALTIES},
            cv=GroupKFold(FOLDS),
            scoring="neg_mean_squared_error",
        )
        search.fit(features[fitted], readings.mass[fitted], groups=readings.trial[fitted])
        read = {"size": features.shape[1], "inferred": search.predict(features[tested])}
        tables.append(pd.DataFrame({"source": source, **told, **read}))
    return pd.concat(tables, ignore_index=True)
