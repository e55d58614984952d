"""The exported controller, as it runs on a robot: onnxruntime and NumPy, no torch and no simulator.

controller = Controller.load("exported")
targets = controller.step(Measured(...), command)     # every 1 / controller.frequency seconds
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from iowbc.arrays import Array, Mask, places
from iowbc.control.command import HEIGHT
from iowbc.control.references import both_wrists
from iowbc.control.sensors import Measured
from iowbc.deploy.contract import Contract, read_contract, readable, require_sealed
from iowbc.deploy.exported_folder import CONTRACT, ROBOT, SETTLE, STEP, exported_folder
from iowbc.deploy.plausibility import WIDE, Limits, Plausibility, TargetGuard
from iowbc.errors import ContractBroken
from iowbc.recipe.section import Section
from iowbc.recipe.task.joint_references import Grasps
from iowbc.robot.description import Robot, load_robot

onnxruntime.disable_telemetry_events()  # in case the process loaded the library before `iowbc`

Values = dict[str, NDArray[np.float32]]


def open_session(path: Path) -> onnxruntime.InferenceSession:
    """A session on one thread: the graph is small, and a control loop shares its processor."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.enable_mem_reuse = False  # its planner takes seconds for the iterations of `settle` and saves 10 MB
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def require_traced(session: onnxruntime.InferenceSession, contract: Section, path: Path, graph: str) -> None:
    """Raises ContractBroken if the contract at `path` is not the one in the metadata of the graph of that name."""
    traced = session.get_modelmeta().custom_metadata_map.get("contract", "{}")
    if type(contract).model_validate_json(traced) != contract.model_copy(update={"files": {}}):
        raise ContractBroken(f"{path}: differs from the contract with which {graph} was made; export again")


def run(session: onnxruntime.InferenceSession, inputs: Values) -> Values:
    """Outputs by name; inputs that the graph does not have are ignored."""
    names = [port.name for port in session.get_outputs()]
    found: list[Any] = session.run(names, {port.name: inputs[port.name] for port in session.get_inputs()})
    return dict(zip(names, found, strict=True))


@dataclass(frozen=True)
class Targets:
    """Targets and gains for the joints' PD loops until the next step."""

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
    """Reason to hold each robot's, "" if not held: an implausible measurement or command, an old measurement, targets
    that are not finite or jump."""


class Controller:
    """The exported graphs with their state and guard, for n robots at once."""

    def __init__(
        self,
        contract: Contract,
        robot: Robot,
        settle: onnxruntime.InferenceSession,
        step: onnxruntime.InferenceSession,
        robots: int,
        limits: Limits,
    ) -> None:
        self.contract, self.robot, self.robots = contract, robot, robots
        self.frequency = contract.control_frequency
        self._settle, self._step = settle, step
        self._kp, self._kd = np.array(contract.kp), np.array(contract.kd)
        self._plausibility = Plausibility(contract, limits, robots)
        self._guard = TargetGuard(robots, np.array(contract.velocity_limit), 1.0 / self.frequency)
        shapes = {port.name: (robots, *port.shape) for port in contract.inputs}
        self._good = {name: np.zeros(shapes[name]) for name in self._plausibility.names}
        self._good["command"][:, HEIGHT] = robot.default_height
        self._good["joint_position"] += contract.default_position
        self._good["projected_gravity"][:, 2] = -1.0
        if "object_quaternion" in self._good:
            self._good["object_quaternion"][:, 0] = 1.0
        self.inputs: Values = {}
        """Inputs of the last step, with the last good ones of robots whose own were refused."""
        self.targets: Array = np.zeros((robots, len(contract.joints)))
        """Joint targets of the last step, (n, joints) [rad]."""
        self._scene = {name: np.zeros(shapes[name], np.float32) for name in ("grasp", "load")}
        self._state = np.zeros(shapes["state"], np.float32)
        self._starts: Mask = np.ones(robots, np.bool_)
        self._places = places({part.name: math.prod(part.shape) for part in contract.state})
        self.reset(scene="lift")

    @classmethod
    def load(cls, folder: Path | str, robots: int = 1, limits: Limits = WIDE) -> Self:
        """The controller in a folder, or the export of the recipe with that name (see `exported_folder`). `limits`:
        plausible measurements. Raises ContractBroken if the folder does not match its contract, ValueError for fewer
        than one robot."""
        if robots < 1:
            raise ValueError(f"robots: {robots}, expected 1 or more")
        folder = exported_folder(folder)
        contract = read_contract(folder)
        with readable(folder / ROBOT):
            robot = load_robot(folder / ROBOT)
        require_sealed(contract.files, folder / CONTRACT, f"{ROBOT}/{robot.mjcf.name}")
        if robot.joints != contract.joints:
            raise ContractBroken(
                f"{folder / ROBOT}: joints {robot.joints} differ from the contract's {contract.joints}; export again"
            )
        first = tuple(port for port in contract.inputs if port.name in contract.settle)
        sessions = []
        for name, ports in ((SETTLE, first), (STEP, contract.inputs)):
            with readable(folder / name):
                session = open_session(folder / name)
                found = {port.name: tuple(port.shape[1:]) for port in session.get_inputs()}
            if found != (said := {port.name: port.shape for port in ports}):
                raise ContractBroken(f"{folder / name}: inputs are {found}, the contract says {said}; export again")
            sessions.append(session)
            require_traced(session, contract, folder / CONTRACT, name)
        controller = cls(contract, robot, sessions[0], sessions[1], robots, limits)
        state = {"state": next(port for port in contract.inputs if port.name == "state").shape}
        with readable(folder / SETTLE):
            settled = controller._settled(controller._good)
        _require_numbers(folder / SETTLE, {"state": settled}, state)
        with readable(folder / STEP):
            outputs = run(controller._step, controller._as_inputs(controller._good | {"state": settled}))
        _require_numbers(folder / STEP, outputs, {port.name: port.shape for port in contract.outputs})
        return controller

    def reset(self, which: Mask | None = None, *, scene: str | None = None) -> None:
        """Reset the robots marked in a boolean (n,), or all; `scene` sets base grasp and expected load ("lift" at
        first). Raises ValueError for any other mask and for an unknown scene."""
        which = np.ones(self.robots, np.bool_) if which is None else np.asarray(which)
        if which.dtype != np.bool_ or which.shape != (self.robots,):
            raise ValueError(
                f"reset: expected a boolean for each of {self.robots} robots, got {which.dtype} of shape {which.shape}"
            )
        if scene is not None:
            self._scene["grasp"][which] = both_wrists(base_grasp(self.contract.references.grasps, scene))
            self._scene["load"][which] = getattr(self.contract.references.loads, scene)
        self._starts = self._starts | which

    def step(self, measured: Measured, command: Array, *, measured_at: Array | float | None = None) -> Targets:
        """Joint targets for the next control period.

        command: C, (n, 11) or (11,); approached at the rates of training and clamped to the feasible map. measured_at:
        time stamps of the measurements, (n,) or one [s], of any clock; without them a measurement is old when its
        values repeat.

        A robot whose measurement or command is implausible or old (see `Limits`) keeps its gait phase and history, and
        holds its last good targets. One whose targets are not finite or jump (see `guard.JUMP`) holds them, too; see
        `Targets.held` and `Targets.reasons`. Without good targets so far it holds its last measured joints, or the
        default posture. Reset a robot that was held for long. Raises ValueError for a wrong shape or a missing
        quantity, and then changes nothing.
        """
        given, refusals = self._judged(measured, command, measured_at)
        state = self._state
        if self._starts.any():
            state = np.where(self._starts[:, None], self._settled(given), state)
        inputs = self._as_inputs(given | {"state": state})
        outputs = run(self._step, inputs)
        passed, reasons = self._guard.passed(
            outputs["target"].astype(np.float64), self._starts, given["joint_position"], refusals
        )
        held: Mask = np.array([reason != "" for reason in reasons])
        after, action = outputs["state_next"].copy(), self._places["action"]
        after[held, action] = state[held, action]
        whole: Mask = np.asarray(np.isfinite(after).all(axis=1))
        after[~whole] = state[~whole]
        refused = np.zeros(self.robots, np.bool_)
        refused[list(refusals)] = True
        self._state = np.where(refused[:, None], self._state, after)
        self._starts = self._starts & refused
        self.inputs, self.targets = inputs, passed
        return Targets(passed, self._kp, self._kd, outputs["action"], outputs["support_reference"], held, reasons)

    def settled_posture(self, command: Array) -> Array:
        """Joint positions at which the references start for a command C, (n, 11) or (11,); (n, joints) [rad]."""
        state = self._settled(self._good | {"command": np.tile(command, (self.robots, 1))[: self.robots]})
        joints = np.zeros((self.robots, len(self.contract.joints)))
        joints[:, self.contract.support] = state[:, self._places["posture"]]
        joints[:, self.contract.interaction] = state[:, self._places["arms"]]
        return joints

    @property
    def state(self) -> Values:
        """Copy of the control loop's state, by the names of the contract's `state`, (n, size) each."""
        return {name: self._state[:, place].copy() for name, place in self._places.items()}

    def _judged(
        self, measured: Measured, command: Array, measured_at: Array | float | None
    ) -> tuple[dict[str, Array], dict[int, str]]:
        """Command and measured inputs of the graph, and by robot the reason for using its last good ones."""
        wanted = np.asarray(command, np.float64)
        values = vars(measured) | {"command": np.tile(wanted, (self.robots, 1)) if wanted.ndim == 1 else wanted}
        given = {}
        for name, good in self._good.items():
            if (value := values[name]) is None:
                raise ValueError(f"{name}: this policy needs it, with shape {good.shape}; got nothing")
            if np.shape(value) != good.shape:
                raise ValueError(f"{name}: expected shape {good.shape}, got {np.shape(value)}")
            given[name] = np.array(value, np.float64)
        stamps = None if measured_at is None else np.broadcast_to(np.asarray(measured_at, np.float64), self.robots)
        with np.errstate(over="ignore", invalid="ignore"):
            refusals = self._plausibility.refusals(given, stamps)
        for robot in refusals:
            for name, good in self._good.items():
                given[name][robot] = good[robot]
        self._good = given
        return given, refusals

    def _settled(self, given: dict[str, Array]) -> Array:
        """The first state of every robot, (n, size of the state)."""
        return run(self._settle, self._as_inputs(given))["state"]

    def _as_inputs(self, given: dict[str, Array]) -> Values:
        return {name: np.array(value, np.float32) for name, value in (given | self._scene).items()}


def base_grasp(grasps: Grasps, scene: str) -> tuple[float, float, float]:
    """The left wrist's base grasp in a scene [m]. Raises ValueError for a scene without one."""
    known = dict(grasps)
    if scene not in known:
        raise ValueError(f"no base grasp for scene {scene!r}; known: {', '.join(known)}")
    return known[scene]


def _require_numbers(path: Path, outputs: Values, said: dict[str, tuple[int, ...]]) -> None:
    """Raises ContractBroken for a graph whose outputs have other shapes than the contract says, or are not finite."""
    made = {name: value.shape[1:] for name, value in outputs.items()}
    if made != said:
        raise ContractBroken(f"{path}: outputs are {made}, the contract says {said}; export again")
    if broken := [name for name, value in outputs.items() if not np.isfinite(value).all()]:
        raise ContractBroken(f"{path}: {', '.join(broken)} not finite: the weights are no numbers; export again")
