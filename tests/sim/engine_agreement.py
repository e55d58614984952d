"""Experiments in which MuJoCo and Drake must agree with each other and with theory."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.robot.description import GRAVITY, Robot
from iowbc.sim.objects import measured
from iowbc.sim.simulation import Simulation
from iowbc.sim.state import SimulationState

TIMESTEP = 0.001
"""Physics step of both engines [s], short enough that integration errors do not mask the comparison."""
IMMOVABLE = 1e6
"""Mass and inertia that make a base immovable [kg, kg·m²]."""
HEIGHT = 2.0
"""Height by which a robot is lifted off the ground [m]."""
STEP = 0.1
"""Step of a joint's target [rad]."""
LOAD = 8.0
"""Mass of a held object [kg]."""
CRATE, ROLLING = 40.0, 0.08
"""Mass of a crate [kg] and its rolling resistance as a fraction of its weight."""


@dataclass(frozen=True)
class Agreement:
    """One quantity in both engines."""

    name: str
    unit: str
    engines: Sequence[float]
    """Values in MuJoCo and Drake; for a difference between the engines, zero and the difference."""
    law: float = np.nan
    """Theoretical value; NaN if there is none."""
    tolerance: float = np.inf
    """Largest expected difference of the engines."""

    @property
    def agrees(self) -> bool:
        return bool(abs(self.engines[0] - self.engines[1]) <= self.tolerance)


def free_fall(robot: Robot) -> list[Agreement]:
    """A robot that moves all joints as it falls: its centre of mass falls by g t² / 2, its base turns."""
    fallen, turned, joints = [], [], []
    for simulation in _both(robot, ["free"]):
        _lift(simulation)
        simulation.step()
        begin, speed = simulation.state.com_position[0, 2], simulation.state.system_velocity[0, 2]
        simulation.target[:] += 0.3 * np.sin(np.arange(len(robot.joints)))
        _run(simulation, 25)
        fallen.append(begin - simulation.state.com_position[0, 2] + 0.5 * speed)
        turned.append(np.degrees(2.0 * np.arccos(min(1.0, abs(simulation.state.base_quaternion[0, 0])))))
        joints.append(simulation.state.joint_position[0].copy())
    apart = float(np.abs(joints[0] - joints[1]).max())
    return [
        Agreement("fall of the centre of mass in 0.5 s", "m", fallen, law=0.125 * GRAVITY, tolerance=0.002),
        Agreement("turn of the base meanwhile", "deg", turned, tolerance=0.5),
        Agreement("largest distance of a joint", "rad", (0.0, apart), tolerance=0.005),
    ]


def arm_pendulum(robot: Robot) -> list[Agreement]:
    """An arm that swings about its shoulder, whose motor is off."""
    first = robot.interaction[0]
    traces = []
    for simulation in _both(robot, ["free"]):
        _hold_base(simulation)
        _edit(simulation, actuator_gainprm=(first, 0.0), actuator_biasprm=(first, 0.0))
        traces.append(_run(simulation, 150)[:, 0, first])
    periods = [_period(trace) for trace in traces]
    swings = [np.ptp(trace[-75:]) / np.ptp(trace[:75]) for trace in traces]
    return [
        Agreement("period of an arm that swings about its shoulder", "s", periods, tolerance=0.005),
        Agreement("its swing of the last 1.5 s over that of the first", "1", swings, tolerance=0.02),
    ]


def step_responses(robot: Robot) -> list[Agreement]:
    """A step of each joint's target, the base held in the air."""
    count = len(robot.joints)
    size = np.where(robot.default_position + STEP < robot.upper, STEP, -STEP)
    responses = []
    for simulation in _both(robot, ["free"] * count):
        _hold_base(simulation)
        _run(simulation, 50)
        begin = np.diag(simulation.state.joint_position).copy()
        simulation.target[:] += np.diag(size)
        responses.append((np.diagonal(_run(simulation, 25), axis1=1, axis2=2) - begin) / size)
    rises = [float(np.mean(np.argmax(response > 0.63, axis=0) + 1)) * 20.0 for response in responses]
    apart = 100.0 * float(np.abs(responses[0] - responses[1]).max())
    return [
        Agreement("63 % of a step of the target, mean of all joints", "ms", rises, tolerance=2.0),
        Agreement("largest distance of two responses", "% of the step", (0.0, apart), tolerance=2.0),
    ]


def static_load(robot: Robot) -> list[Agreement]:
    """A box held still, the base held in the air."""
    weights, shoulders, torques = [], [], []
    for simulation in _both(robot, ["lift"], object_mass=LOAD):
        _hold_base(simulation)
        _run(simulation, 150)
        state = simulation.state
        weights.append(-state.grip_force[0, :, 2].sum())
        shoulders.append(state.joint_torque[0, robot.interaction[0]])
        torques.append(state.joint_torque[0].copy())
    apart = float(np.abs(torques[0] - torques[1]).max())
    return [
        Agreement(f"weight of {LOAD:g} kg in the hands", "N", weights, law=LOAD * GRAVITY, tolerance=0.3),
        Agreement("torque of a shoulder that holds it", "N·m", shoulders, tolerance=0.1),
        Agreement("largest difference of a torque", "N·m", (0.0, apart), tolerance=0.1),
    ]


def crate_threshold(robot: Robot) -> list[Agreement]:
    """Crates out of reach, pulled with less and with more than their rolling resistance."""
    resistance, factors = ROLLING * CRATE * GRAVITY, np.array([0.97, 1.03])
    ways = []
    for simulation in _both(robot, ["push"] * 2, gap=3.0, object_mass=CRATE, object_ground_friction=ROLLING):
        begin = simulation.state.object_position[:, :2].copy()
        simulation.planned_impulse[:, 1] = factors * resistance
        _run(simulation, 100)
        ways.append(np.linalg.norm(simulation.state.object_position[:, :2] - begin, axis=1))
    law = 0.5 * (factors[1] - 1.0) * resistance / CRATE * 2.0**2
    less, more = zip(*ways, strict=True)
    return [
        Agreement("way of a crate in 2 s, pulled with 97 % of its resistance", "m", less, 0.0, 0.005),
        Agreement("the same with 103 %", "m", more, law, 0.005),
    ]


def swinging_box(robot: Robot) -> list[Agreement]:
    """A box between hands without torsion, struck and left to swing, the base held in the air."""
    traces = []
    for simulation in _both(robot, ["lift"], torsion=0.0, object_mass=LOAD):
        _hold_base(simulation)
        _run(simulation, 100)
        simulation.planned_impulse[:, 0] = 30.0
        _run(simulation, 5)
        simulation.planned_impulse[:] = 0.0
        traces.append(_run(simulation, 150, lambda state: state.object_angular_velocity[:, 1])[:, 0])
    periods = [_period(trace) for trace in traces]
    kept = [float(np.square(trace[-75:]).max() / np.square(trace[:75]).max()) for trace in traces]
    scene = Recipe().scenes.lift
    assert scene.object is not None
    height = scene.grasp.height
    law = 2.0 * np.pi * np.sqrt((measured(scene.object).about_axes[1] + height**2) / (GRAVITY * height))
    return [
        Agreement("period of a box that swings between the hands", "s", periods, law=float(law), tolerance=0.01),
        Agreement("its energy in the last 1.5 s over that in the first", "1", kept, tolerance=0.05),
    ]


def _both(
    robot: Robot, scenes: list[str], gap: float = 0.01, torsion: float | None = None, **fixed: float
) -> Iterator[Simulation]:
    """The same simulation in MuJoCo and in Drake, without randomness; `fixed`: quantities that are fixed."""
    off = {name: {"enabled": False} for name in ("randomization", "partner", "impulses", "pushes", "sensing")}
    palms = {} if torsion is None else {"torsion": torsion, "by_friction": 0.0, "swing_damping": 0.0}
    usual = Recipe().scenes
    lift = usual.lift.model_copy(update={"grasp": usual.lift.grasp.model_copy(update=palms)})
    own = {"push": usual.push.model_copy(update={"gap": gap}), "lift": lift}
    physics = {"timestep": TIMESTEP, "body_contact": "nothing"}
    recipe = Recipe.model_validate({**off, "physics": physics, "scenes": own})
    n = len(scenes)
    held = {name: np.full(n, value) for name, value in fixed.items()} | {"start_yaw": np.zeros(n)}
    for drake in (None, Drake(timestep=TIMESTEP)):
        simulation = Simulation(robot, recipe, envs=np.arange(n), seed=0, scenes=scenes, fixed=held, drake=drake)
        simulation.reset(np.arange(n), np.tile(robot.default_position, (n, 1)))
        yield simulation


def _lift(simulation: Simulation) -> None:
    """Lifts robots and held objects off the ground."""
    for world in simulation.worlds:
        world.qpos[:, 2] += HEIGHT
        if world.scene.kind == "lift" and world.layout.object_position is not None:
            world.qpos[:, world.layout.object_position.start + 2] += HEIGHT


def _hold_base(simulation: Simulation) -> None:
    _lift(simulation)
    base = simulation.worlds[0].layout.base
    _edit(simulation, body_mass=(base, IMMOVABLE), body_inertia=(base, IMMOVABLE))
    simulation.planned_push[:, 2] = IMMOVABLE * GRAVITY


def _edit(simulation: Simulation, **changes: tuple[int, float]) -> None:
    """Sets entries of the models' fields, by field: place and value."""
    for world in simulation.worlds:
        saved = world.snapshot()
        for name, (place, value) in changes.items():
            saved[name][:, place] = value
        world.restore(saved)


def _run(
    simulation: Simulation, periods: int, seen: Callable[[SimulationState], Array] = lambda state: state.joint_position
) -> Array:
    """Observed values after each control period."""
    trace = []
    for _ in range(periods):
        simulation.step()
        trace.append(seen(simulation.state).copy())
    return np.array(trace)


def _period(trace: Array) -> float:
    """Mean period of an oscillation sampled at 50 Hz [s]."""
    away = trace - 0.5 * (trace.max() + trace.min())
    before = np.flatnonzero((away[:-1] < 0.0) & (away[1:] >= 0.0))
    crossings = before + away[before] / (away[before] - away[before + 1])
    return float(np.mean(np.diff(crossings))) * 0.02
