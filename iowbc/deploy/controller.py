"""The exported controller, as it runs on a robot: onnxruntime and NumPy, no torch and no simulator.

controller = Controller.load("exported")
targets = controller.step(Measured(...), command)     # every 1 / controller.frequency seconds
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from iowbc.arrays import Array, Mask, as_slice
from iowbc.control import gait
from iowbc.control.command import COMMAND, HEIGHT, YAW_RATE, approach, rate_limits
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.control.sensors import Measured
from iowbc.deploy.contract import Contract, generator_folder, read_contract, readable, require_sealed
from iowbc.deploy.exported_folder import GENERATOR, GRAPH, ROBOT, exported_folder
from iowbc.deploy.guard import TargetGuard
from iowbc.deploy.plausibility import WIDE, Limits, Plausibility
from iowbc.deploy.session import Values, open_session, run
from iowbc.errors import ContractBroken
from iowbc.recipe.task.joint_references import Grasps
from iowbc.robot.description import Robot, load_robot

SAME_POSTURE = 1e-4
"""How far the generator in the graph may be from that beside it [rad]: sums that are rounded in another order."""


@dataclass(frozen=True)
class Targets:
    """What the joints' PD loops are to follow until the next step."""

    position: Array
    """Position targets of all joints, (n, 29) [rad]."""
    kp: Array
    """Position gains, (29,) [N·m/rad]."""
    kd: Array
    """Velocity gains, (29,) [N·m·s/rad]."""
    action: Array
    """The policy's residual action, (n, 15)."""
    support_reference: Array
    """θ_S_ref with the gait prior, (n, 15) [rad]."""
    held: Mask
    """Robots whose last good targets are held, (n,)."""
    reasons: tuple[str, ...]
    """Why each robot's are, "" where they are not: a measurement or command that cannot be true, an old measurement,
    targets that are no numbers or that jump."""


@dataclass(frozen=True)
class Loop:
    """What the control loop remembers of n robots from one step to the next."""

    command: Array
    """C in force, (n, 11)."""
    arms: Array
    """θ_I_ref, (n, arm joints) [rad]."""
    posture: Array
    """θ_S_ref without the gait prior, (n, support joints) [rad]."""
    heading_reference: Array
    """Measured heading at the start plus the integrated commanded yaw rate, (n,) [rad]."""
    phase: Array
    """Gait phase, (n,)."""
    stepping: Mask
    """Whether the gait clock runs, (n,)."""
    starts: Mask
    """Robots whose next step is their first, (n,)."""
    action: Array
    """The action that the motors follow, (n, support joints) float32."""
    history: Array
    """H_t, as the graph returned it, float32."""

    def except_for(self, robots: list[int], earlier: Self) -> Self:
        """The same, with some robots as they were."""
        if not robots:
            return self
        mixed = {field.name: getattr(self, field.name).copy() for field in fields(self)}
        for name, values in mixed.items():
            values[robots] = getattr(earlier, name)[robots]
        return replace(self, **mixed)


class Controller:
    """The exported policy with its arm kinematics and gait clock, for n robots at once."""

    def __init__(
        self,
        contract: Contract,
        robot: Robot,
        session: onnxruntime.InferenceSession,
        references: ReferenceLayer,
        robots: int,
        limits: Limits,
    ) -> None:
        self.contract, self.robot, self.robots = contract, robot, robots
        self.frequency = contract.control_frequency
        self._session, self._references = session, references
        self._support, self._interaction = as_slice(robot.support), as_slice(robot.interaction)
        self._largest_step = rate_limits(contract.commands.rates) / self.frequency
        self._kp, self._kd = np.array(contract.kp), np.array(contract.kd)
        self._blank = {port.name: np.zeros((robots, *port.shape), np.float32) for port in contract.inputs}
        if "object_quaternion" in self._blank:
            self._blank["object_quaternion"][:, 0] = 1.0
        self._plausibility = Plausibility(contract, limits, robots)
        self._guard = TargetGuard(robots, np.array(contract.velocity_limit), 1.0 / self.frequency)
        self._good = {name: self._blank[name].astype(np.float64) for name in self._plausibility.names}
        self._good["command"][:, HEIGHT] = robot.default_height
        self._good["joint_position"] += contract.default_position
        self._good["projected_gravity"][:, 2] = -1.0
        self.inputs: Values = {}
        self.outputs: Values = {}
        support, arms = len(contract.support), len(contract.interaction)
        self._grasp: Array = np.zeros((robots, 2, 3))
        self._load: Array = np.zeros(robots)
        self._loop = Loop(
            command=np.zeros((robots, len(COMMAND))),
            arms=np.zeros((robots, arms)),
            posture=np.zeros((robots, support)),
            heading_reference=np.zeros(robots),
            phase=np.zeros(robots),
            stepping=np.zeros(robots, np.bool_),
            starts=np.ones(robots, np.bool_),
            action=self._blank["last_action"],
            history=self._blank["history"],
        )
        self.reset()

    @classmethod
    def load(cls, folder: Path | str, robots: int = 1, limits: Limits = WIDE) -> Self:
        """The controller in an exported folder, or the one that a recipe exported here, by the recipe's name.

        `limits` of measurements that are believed. Raises ContractBroken where the folder is not what its contract
        says, ValueError for fewer than one robot.
        """
        if robots < 1:
            raise ValueError(f"robots: {robots}, expected 1 or more")
        folder = exported_folder(folder)
        contract = read_contract(folder)
        with readable(folder / ROBOT):
            robot = load_robot(folder / ROBOT)
        require_sealed(contract, folder, f"{ROBOT}/{robot.mjcf.name}")
        if robot.joints != contract.joints:
            raise ContractBroken(
                f"{folder / ROBOT}: joints {robot.joints} differ from the contract's {contract.joints}; export again"
            )
        with readable(folder / GRAPH):
            session = open_session(folder / GRAPH)
            found = {port.name: tuple(port.shape[1:]) for port in session.get_inputs()}
        if found != (said := {port.name: port.shape for port in contract.inputs}):
            raise ContractBroken(f"{folder / GRAPH}: inputs are {found}, the contract says {said}; export again")
        generator = generator_folder(contract, folder)
        with readable(folder / GENERATOR):
            references = ReferenceLayer(robot, contract.references, generator)
        with readable(folder / GRAPH):
            controller = cls(contract, robot, session, references, robots, limits)
            outputs, posture = controller._at_rest()
        made = {name: value.shape[1:] for name, value in outputs.items()}
        if made != (said := {port.name: port.shape for port in contract.outputs}):
            raise ContractBroken(f"{folder / GRAPH}: outputs are {made}, the contract says {said}; export again")
        broken = [name for name, value in outputs.items() if not np.isfinite(value).all()]
        if broken:
            raise ContractBroken(
                f"{folder / GRAPH}: {', '.join(broken)} not finite: the weights are no numbers; export again"
            )
        if not (apart := float(np.abs(outputs["support_reference"] - posture).max())) <= SAME_POSTURE:
            raise ContractBroken(
                f"{folder / GRAPH}: its reference generator is {apart:.1e} rad away from the one in "
                f"{folder / GENERATOR}; export again"
            )
        return controller

    def reset(self, which: Mask | None = None, *, scene: str | None = None) -> None:
        """Forget the past of the marked robots, a boolean (n,), or of all; `scene` chooses base grasp and expected load
        ("lift" at first). Raises ValueError for any other mask and for an unknown scene."""
        which = np.ones(self.robots, np.bool_) if which is None else np.asarray(which)
        if which.dtype != np.bool_ or which.shape != (self.robots,):
            raise ValueError(
                f"reset: expected a boolean for each of {self.robots} robots, got {which.dtype} of shape {which.shape}"
            )
        if scene is not None or not self._grasp.any():
            self._grasp[which] = both_wrists(base_grasp(self.contract.references.grasps, scene or "lift"))
            self._load[which] = getattr(self.contract.references.loads, scene or "lift")
        self._loop = replace(self._loop, starts=self._loop.starts | which)

    def step(
        self,
        measured: Measured,
        command: Array,
        *,
        measured_at: Array | float | None = None,
        limit_rates: bool = True,
    ) -> Targets:
        """Joint targets for the next control period.

        command: C, (n, 11) or (11,); clamped to the feasible map, and approached at the rates of training unless
        `limit_rates` is off. measured_at: time stamps of the measurements, (n,) or one [s], of any clock; without them
        a measurement is old when its values repeat.

        A robot whose measurement or command cannot be true or is old (see `Limits`) stays where it was in its gait and
        history, and holds its last good targets, as does one whose targets are not finite or further away than joints
        move in the time; the others go on: see `Targets.held` and `Targets.reasons`. One that never had good ones holds
        its joints where they were last measured, or the default posture. Reset a robot that was held for long. Raises
        ValueError for a shape that does not fit or a missing quantity, and is then as before the call.
        """
        given, refusals = self._judged(measured, command, measured_at)
        loop = self._advanced(given["command"], limit_rates)
        heading = np.where(loop.starts, given["heading"][:, 0], loop.heading_reference)
        inputs = self._blank | self._as_inputs(
            **given
            | {
                "command": loop.command,
                "arm_reference": loop.arms,
                "heading_reference": heading[:, None],
                "gait": np.stack([loop.phase, loop.stepping], axis=1),
                "last_action": loop.action,
                "history": loop.history,
                "restart": loop.starts[:, None],
            }
        )
        outputs = run(self._session, inputs)
        position = np.empty((self.robots, len(self.contract.joints)))
        position[:, self._support] = outputs["support_target"]
        position[:, self._interaction] = self._references.arm_target(loop.arms, loop.posture, loop.command, self._load)
        passed, reasons = self._guard.passed(position, loop.starts, given["joint_position"], refusals)
        held: Mask = np.array([reason != "" for reason in reasons])
        whole: Mask = np.asarray(np.isfinite(outputs["history_next"]).all(axis=(1, 2)))
        advanced = replace(
            loop,
            starts=np.zeros(self.robots, np.bool_),
            heading_reference=heading + loop.command[:, YAW_RATE] / self.frequency,
            action=np.where(held[:, None], loop.action, outputs["action"]),
            history=np.where(whole[:, None, None], outputs["history_next"], loop.history),
        )
        self._loop = advanced.except_for(list(refusals), self._loop)
        self.inputs, self.outputs = inputs, outputs
        return Targets(passed, self._kp, self._kd, outputs["action"], outputs["support_reference"], held, reasons)

    def _judged(
        self, measured: Measured, command: Array, measured_at: Array | float | None
    ) -> tuple[dict[str, Array], dict[int, str]]:
        """Command and measured inputs of the graph, and why those of some robots were replaced by their last good
        ones."""
        wanted = np.asarray(command, np.float64)
        values = vars(measured) | {"command": np.tile(wanted, (self.robots, 1)) if wanted.ndim == 1 else wanted}
        given = {name: self._shaped(name, values[name], good.shape) for name, good in self._good.items()}
        stamps = None if measured_at is None else np.broadcast_to(np.asarray(measured_at, np.float64), self.robots)
        with np.errstate(over="ignore", invalid="ignore"):
            refusals = self._plausibility.refusals(given, stamps)
        for robot in refusals:
            for name, good in self._good.items():
                given[name][robot] = good[robot]
        self._good = given
        return given, refusals

    def _advanced(self, wanted: Array, limit_rates: bool) -> Loop:
        """Command, references and gait clock of this step; robots that start are settled in their grasp."""
        loop, starts = self._loop, self._loop.starts
        settings, dt = self.contract.references.gait, 1.0 / self.frequency
        limited = approach(loop.command, wanted, self._largest_step) if limit_rates else wanted
        command = self._references.clamp(np.where(starts[:, None], wanted, limited))
        moving = gait.wants_to_move(command, settings)
        arms, posture = loop.arms, loop.posture
        if not starts.all():
            arms, posture = self._references.advance(arms, posture, command, self._grasp, dt)
        phase, stepping = gait.advance(loop.phase, loop.stepping, moving, settings, dt)
        action = loop.action
        if starts.any():
            settled = self._references.start(command, self._grasp)
            arms, posture = (
                np.where(starts[:, None], new, old) for new, old in zip(settled, (arms, posture), strict=True)
            )
            phase, stepping = np.where(starts, 0.0, phase), stepping & ~starts
            action = np.where(starts[:, None], np.float32(0.0), action)
        return replace(loop, command=command, arms=arms, posture=posture, phase=phase, stepping=stepping, action=action)

    def _at_rest(self) -> tuple[Values, Array]:
        """Outputs of the graph in the default posture, and what its θ_S_ref should be there, (n, support joints) [rad].

        Raises whatever onnxruntime raises where the graph does not run.
        """
        command = np.zeros((self.robots, len(COMMAND)))
        command[:, HEIGHT] = self.robot.default_height
        arms = np.tile(self.robot.default_position[self.robot.interaction], (self.robots, 1))
        outputs = run(self._session, self._blank | self._as_inputs(command=command, arm_reference=arms))
        return outputs, self._references.support(arms, command)

    @staticmethod
    def _as_inputs(**values: NDArray[Any]) -> dict[str, NDArray[np.float32]]:
        return {name: np.array(value, np.float32) for name, value in values.items()}

    @staticmethod
    def _shaped(name: str, value: Array | None, shape: tuple[int, ...]) -> Array:
        """A copy of a value that has its shape. Raises ValueError."""
        if value is None:
            raise ValueError(f"{name}: this policy needs it, with shape {shape}; got nothing")
        if np.shape(value) != shape:
            raise ValueError(f"{name}: expected shape {shape}, got {np.shape(value)}")
        return np.array(value, np.float64)


def base_grasp(grasps: Grasps, scene: str) -> tuple[float, float, float]:
    """The left wrist's base grasp in a scene [m]. Raises ValueError for a scene without one."""
    known = dict(grasps)
    if scene not in known:
        raise ValueError(f"no base grasp for scene {scene!r}; known: {', '.join(known)}")
    grasp: tuple[float, float, float] = known[scene]
    return grasp
