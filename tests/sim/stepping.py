"""How tests step a simulation."""

from iowbc.sim.simulation import Simulation


def run(simulation: Simulation, steps: int) -> None:
    for _ in range(steps):
        simulation.step()
