"""Episodes as displayed, independent of the simulation: moments, tracks of them, and replays of evaluated trials."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
import pandas as pd
from scipy.spatial import ConvexHull

from iowbc.arrays import Array
from iowbc.control.command import COMMAND
from iowbc.evaluation.films import Actor
from iowbc.evaluation.trials.errors import deviations_from_clamped
from iowbc.evaluation.trials.interaction import load_metrics
from iowbc.evaluation.trials.metrics import replayed
from iowbc.evaluation.trials.rollout import in_batch, play_in, playing, trace_of
from iowbc.recipe.evaluation.evaluation import Success
from iowbc.robot import rotations
from iowbc.robot.description import GRAVITY
from iowbc.sim.rendering.appearance import Appearance
from iowbc.sim.rendering.forces import Force, forces
from iowbc.sim.simulation import Simulation
from iowbc.task.batch import Batch
from iowbc.task.record.signals import RECORDED
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

PAST = 60.0
"""Length of the past of an episode that is kept, and can be looked at [s]."""
WINDOW = 3.0
"""Figures are means over so long a time [s]; the weight in the hands leaves out its first second."""


@dataclass(frozen=True)
class Moment:
    """One control step, world frame."""

    seconds: float
    """Time since the start of the episode [s]."""
    bodies: Array
    """Position and quaternion (wxyz) of every body of the model, (bodies, 7)."""
    reference: Array
    """The same for the robot in its reference posture, the base where it is, (bodies, 7)."""
    forces: tuple[Force, ...]
    balance: Array
    """The point of the ground beneath the centre of mass of robot and held object, (3,) [m]."""
    support: Array
    """Corners of the convex hull of the soles that touch the ground, in order, (k, 3) [m]; k is 0 in the air."""
    command: Array
    """Command of the next step, (11,)."""
    signals: Mapping[str, Array]
    """Figures of the step just made, each (k,); in an environment those that a trial records."""


class SimulationRecorder:
    """Takes down the moments of the first environment of a simulation, which know no reference and no command."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._appearance = Appearance(simulation, 0)
        self.model = self._appearance.model
        """Model for drawing: with visual geoms, and the object's size in the current episode."""
        self._world = simulation.world_of(0)[0]
        robot = simulation.robot
        soles = [self.model.body(name).id for name in robot.sole_bodies]
        self._corners = [
            np.flatnonzero((self.model.geom_bodyid == sole) & (self.model.geom_conaffinity != 0)) for sole in soles
        ]
        self._held = self._world.scene.kind == "lift"

    @property
    def held_mass(self) -> float:
        """Mass of the object in the hands [kg]; 0 without one."""
        return float(self._simulation.drawn["object_mass"][0]) if self._held else 0.0

    def look(self, seconds: float) -> Moment:
        data = self._appearance.update()
        bodies = np.hstack([data.xpos, data.xquat])
        return Moment(
            seconds=seconds,
            bodies=bodies,
            reference=bodies,
            forces=tuple(forces(self._simulation, 0)),
            balance=self._balance(),
            support=self._support(data),
            command=np.zeros(len(COMMAND)),
            signals={},
        )

    def _balance(self) -> Array:
        simulation, state = self._simulation, self._simulation.state
        centre: Array = state.com_position[0].copy()
        if self._held:
            offset = rotations.rotate(state.object_quaternion[:1], simulation.drawn["object_com_offset"][:1])[0]
            part = self.held_mass / (self.held_mass + float(self._world.robot_mass[0]))
            centre += part * (state.object_position[0] + offset - centre)
        centre[2] = 0.0
        return centre

    def _support(self, data: Any) -> Array:
        touching = self._simulation.state.foot_contact[0]
        corners = [data.geom_xpos[points, :2] for points, down in zip(self._corners, touching, strict=True) if down]
        if not corners:
            return np.zeros((0, 3))
        points = np.concatenate(corners)
        hull = points[ConvexHull(points).vertices]
        return np.column_stack([hull, np.zeros(len(hull))])


class MomentRecorder(SimulationRecorder):
    """Takes down the moments of the first environment of a batch, in its present episode."""

    def __init__(self, batch: Batch, signals: Mapping[str, Array]) -> None:
        """`signals`: by name, (n, k); the simulation overwrites them in every step."""
        super().__init__(batch.simulation)
        self.batch, self._signals = batch, signals
        self._reference = mujoco.MjData(self.model)

    def look(self, seconds: float) -> Moment:
        moment = super().look(seconds)
        robot, memory, reference = self._simulation.robot, self.batch.memory, self._reference
        reference.qpos[:] = self._appearance.data.qpos
        joints = reference.qpos[self._world.layout.joints]
        joints[robot.support], joints[robot.interaction] = memory.support[0], memory.arms[0]
        mujoco.mj_kinematics(self.model, reference)
        return replace(
            moment,
            reference=np.hstack([reference.xpos, reference.xquat]),
            command=np.array(self.batch.memory.command[0]).reshape(len(COMMAND)),
            signals={name: values[0].copy() for name, values in self._signals.items()},
        )


class Track:
    """The moments of a recorder's present episode, one a control step."""

    def __init__(self, recorder: MomentRecorder, world: Specification, title: str, kept: int | None = None) -> None:
        """`kept`: how many of the last moments it keeps."""
        self.title, self.model, self.period = title, recorder.model, recorder.batch.period
        self.moments: deque[Moment] = deque(maxlen=kept)
        self.ending = ""
        """Reason of the episode's end; empty before it."""
        self.held_weight = GRAVITY * recorder.held_mass
        """Weight of a held object [N]; 0 without one."""
        self._gait_period = 1.0 / world.recipe.task.references.gait.frequency
        self._joints = recorder.batch.robot.joints

    @property
    def end(self) -> float:
        """Time of the last moment [s]."""
        return self.moments[-1].seconds

    def place(self, seconds: float) -> int:
        """Index of the moment nearest to a time [s]."""
        steps = round((seconds - self.moments[0].seconds) / self.period)
        return int(np.clip(steps, 0, len(self.moments) - 1))

    def latest(self, place: int) -> list[Moment]:
        """The moments of the `WINDOW` that ends at an index."""
        first = max(0, place + 1 - round(WINDOW / self.period))
        return [self.moments[index] for index in range(first, place + 1)]

    def readings(self, place: int) -> tuple[dict[str, float], dict[str, float]]:
        """Means over the `WINDOW` that ends at an index: the paper's errors relative to the clamped command and
        `weight_in_hands`, NaN where nothing is to be measured; and the part of the time at the torque limit, of the
        joints that ever were."""
        seen = self.latest(place)
        trace = trace_of({name: np.stack([one.signals[name] for one in seen]) for name in RECORDED}, self.period)
        deviations = deviations_from_clamped(trace, max(1, round(self._gait_period / self.period)))
        load = load_metrics(trace, self.held_weight, self.held_weight > Success().least_weight)
        shares = zip(self._joints, trace.joint_saturation.mean(axis=0).tolist(), strict=True)
        return deviations.means() | load, {name: share for name, share in shares if share > 0}


def recorded(environment: VectorEnv) -> dict[str, Array]:
    """The signals of an environment that a trial records, by name, (1, k)."""
    return {name: environment.signals[name] for name in RECORDED}


def trial_title(row: "pd.Series[Any]") -> str:
    """A title for a row of `trials.parquet`: the trial's conditions and end."""
    push = f", push {row['impulse']:g} N·s" if row["impulse"] else ""
    case = row["suite"] if row["suite"] == row["case"] else f"{row['suite']}: {row['case']}"
    return f"{case}, {row['mass']:g} kg{push}, trial {row['trial']}: {row['end']} after {row['seconds']:.1f} s"


def played_again(
    actor: Actor, row: "pd.Series[Any]", interrupted: Callable[[], bool], progress: Callable[[float], None]
) -> Track:
    """The trial of a row of the actor's table, step by step; progress: receives the time reached within the trial [s].
    Raises Interrupted once `interrupted()` is true."""
    seen: list[Moment] = []
    with playing(actor.world, [replayed(row)]) as environment:
        recorder, policy = MomentRecorder(environment.batch, recorded(environment)), in_batch(actor.policy, row)
        look = recorder.look
        outcome = play_in(environment, policy, interrupted, progress, lambda seconds: seen.append(look(seconds)))[0]
        track = Track(recorder, actor.world, trial_title(row))
        track.ending = outcome.ending
        track.moments.extend(seen)
        return track
