"""A robot that stands still, and the state machine that drives it."""

import itertools

import numpy as np

from iowbc.arrays import Array
from iowbc.control.sensors import Measured
from iowbc.deploy.controller import Controller
from iowbc.onboard.checks import SafetyLimits
from iowbc.onboard.machine import CycleInputs, Machine, OperatorRequest, State
from iowbc.onboard.messages import Record
from iowbc.onboard.process import PERIOD
from iowbc.onboard.ranges import Ranges
from iowbc.twin.robot import low_state

RAMP = 0.1
"""Time in which these robots stand up [s]."""
BEGINNINGS = itertools.count(0, 100)
"""Times at which robots begin [s], all with one controller, for which time never goes back."""


class Still:
    """A state machine, and the states of a robot that stands where it is asked to."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.machine = Machine(self.controller, "free", SafetyLimits(ramp=RAMP))
        self.standing: Array = Ranges(self.controller.contract).standing
        self.posture = self.controller.settled_posture(self.standing)[0]
        self.begin = float(next(BEGINNINGS))
        self.turns = 0
        self.seen: dict[str, Array] = {}

    @property
    def now(self) -> float:
        return self.begin + self.turns * PERIOD

    def state(self) -> Record:
        """The robot's state at this turn; each has other noise."""
        noise = 1e-3 * np.random.default_rng(self.turns).standard_normal((2, 29))
        measured = Measured(
            projected_gravity=np.array([[0.0, 0.0, -1.0]]),
            base_angular_velocity=np.full((1, 3), noise[0, 0]),
            heading=np.zeros((1, 1)),
            joint_position=self.posture[None] + noise[:1],
            joint_velocity=noise[1:],
        )
        return low_state(round(1e3 * self.now), measured, np.zeros(29))

    def turn(self, request: State | None = None, *, states: tuple[Record, ...] | None = None, **other: float) -> Record:
        """A turn of the loop; `other`: `at` of the command, `late` by which it begins [s], `others`, `charge` [%]."""
        self.turns += 1
        given = (self.state(),) if states is None else states
        now = self.now + other.get("late", 0.0)
        wanted = OperatorRequest(self.standing, other.get("at", now), request, self.seen, now)
        return self.machine.turn(CycleInputs(now, given, wanted, int(other.get("others", 0)), other.get("charge")))

    def until(self, state: State) -> Record:
        """Goes through the states up to one of them; the last command."""
        order = [State.DAMPING, State.STAND, State.RUN]
        for wanted in order[: order.index(state) + 1]:
            command = self.turn(wanted)
            assert self.machine.state is wanted, self.machine.events
            for _ in range(round(self.machine.limits.ramp / PERIOD) + 1 if wanted is State.STAND else 0):
                command = self.turn()
        return command
