"""`iowbc bench control`: how long a control step takes, with nothing loaded but what a robot's computer has."""

import numpy as np

from iowbc.deploy.timing import step_seconds


def control(what: str, steps: int) -> None:
    """Measure and print. Raises ContractBroken where there is no exported controller."""
    print(f"{what}: {steps:,} control steps of one robot on one thread")
    print(f"{'':16}{'median':>12}{'99th percentile':>18}{'longest':>12}")
    for name, taken in zip(("time", "processor time"), 1e3 * step_seconds(what, steps).T, strict=True):
        median, late, longest = (f"{value:.3f} ms" for value in np.quantile(taken, (0.5, 0.99, 1.0)))
        print(f"{name:16}{median:>12}{late:>18}{longest:>12}")
