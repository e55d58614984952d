"""The exported controller, as it runs on a robot: onnxruntime and NumPy, no torch and no simulator.

controller = Controller.load("exported")
targets = controller.step(Measured(...), command)     # every 1 / controller.frequency seconds
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from iowbc.arrays import Array
from iowbc.control import gait
from iowbc.control.command import COMMAND, YAW_RATE, approach, rate_limits
from iowbc.control.feasible_map import FEASIBLE, FeasibleMap
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.control.sensors import Measured
from iowbc.deploy.contract import GENERATOR, GRAPH, ROBOT, Contract, read_contract
from iowbc.errors import ContractBroken
from iowbc.recipe.task.joint_references import Grasps
from iowbc.robot.description import Robot, load_robot

Generator = Callable[[Array, Array], Array]


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


class GraphReferences(ReferenceLayer):
    """The reference layer whose generator is the one inside the graph."""

    def __init__(self, robot: Robot, contract: Contract, feasible: FeasibleMap | None, generator: Generator) -> None:
        super().__init__(robot, contract.references, None)
        self.feasible = feasible
        self._generator = generator

    def support(self, arms: Array, command: Array) -> Array:
        """θ_S_ref without the gait prior, (n, 15) [rad]."""
        return self._generator(arms, command)


class Controller:
    """The exported policy with its arm kinematics and gait clock, for n robots at once."""

    def __init__(
        self,
        contract: Contract,
        robot: Robot,
        session: onnxruntime.InferenceSession,
        feasible: FeasibleMap | None,
        robots: int,
    ) -> None:
        self.contract, self.robot, self.robots = contract, robot, robots
        self.frequency = contract.control_frequency
        self._session = session
        self._references = GraphReferences(robot, contract, feasible, self._support_reference)
        self._largest_step = rate_limits(contract.commands.rates) / self.frequency
        self._kp, self._kd = np.array(contract.kp), np.array(contract.kd)
        self._inputs = {port.name: np.zeros((robots, *port.shape), np.float32) for port in contract.inputs}
        if "object_quaternion" in self._inputs:
            self._inputs["object_quaternion"][:, 0] = 1.0
        self.inputs: dict[str, NDArray[np.float32]] = {}
        self.outputs: dict[str, NDArray[np.float32]] = {}
        actions = len(contract.support)
        self._command: Array = np.zeros((robots, len(COMMAND)))
        self._grasp: Array = np.zeros((robots, 2, 3))
        self._load: Array = np.zeros(robots)
        self._arms: Array = np.zeros((robots, len(contract.interaction)))
        self._support: Array = np.zeros((robots, actions))
        self._phase: Array = np.zeros(robots)
        self._heading_reference: Array = np.zeros(robots)
        self._stepping = np.zeros(robots, np.bool_)
        self._starts = np.ones(robots, np.bool_)
        self.reset()

    @classmethod
    def load(cls, folder: Path | str, robots: int = 1) -> Self:
        """The controller in an exported folder. Raises ContractBroken where it is not what its contract says."""
        folder = Path(folder)
        contract = read_contract(folder)
        robot = load_robot(folder / ROBOT)
        if robot.joints != contract.joints:
            raise ContractBroken(
                f"{folder / ROBOT}: joints {robot.joints} differ from the contract's {contract.joints}; export again"
            )
        session = open_session(folder / GRAPH)
        found = {port.name: tuple(port.shape[1:]) for port in session.get_inputs()}
        if found != (said := {port.name: port.shape for port in contract.inputs}):
            raise ContractBroken(f"{folder / GRAPH}: inputs are {found}, the contract says {said}; export again")
        map_file = f"{GENERATOR}/{FEASIBLE}"
        feasible = FeasibleMap.load(folder / map_file) if map_file in contract.files else None
        return cls(contract, robot, session, feasible, robots)

    def reset(self, which: NDArray[np.bool_] | None = None, *, scene: str | None = None) -> None:
        """Forget the past of the marked robots, (n,), or of all; `scene` chooses base grasp and expected load
        ("lift" at first)."""
        which = np.ones(self.robots, np.bool_) if which is None else which
        self._starts |= which
        if scene is not None or not self._grasp.any():
            self._grasp[which] = both_wrists(base_grasp(self.contract.references.grasps, scene or "lift"))
            self._load[which] = getattr(self.contract.references.loads, scene or "lift")

    def step(self, measured: Measured, command: Array, *, limit_rates: bool = True) -> Targets:
        """Joint targets for the next control period.

        command: C, (n, 11) or (11,); clamped to the feasible map, and approached at the rates of training unless
        `limit_rates` is off. Raises ValueError for a shape that does not fit or a value that is not finite.
        """
        wanted = np.asarray(command, np.float64)
        if wanted.ndim == 1:
            wanted = np.tile(wanted, (self.robots, 1))
        self._check("command", wanted, self._command.shape)
        starts = self._starts.copy()
        limited = approach(self._command, wanted, self._largest_step) if limit_rates else wanted
        self._command = self._references.clamp(np.where(starts[:, None], wanted, limited))
        self._advance(starts)
        for name in (field.name for field in fields(measured)):
            if name in self._inputs:
                value = getattr(measured, name)
                self._check(name, value, self._inputs[name].shape)
                self._inputs[name][:] = value
        self._heading_reference[starts] = self._inputs["heading"][starts, 0]
        self.inputs = self._inputs | self._as_inputs(
            command=self._command,
            arm_reference=self._arms,
            heading_reference=self._heading_reference[:, None],
            gait=np.stack([self._phase, self._stepping], axis=1),
            restart=starts[:, None],
        )
        self.outputs = outputs = self._run(self.inputs)
        self._starts[:] = False
        self._heading_reference += self._command[:, YAW_RATE] / self.frequency
        self._inputs["history"], self._inputs["last_action"] = outputs["history_next"], outputs["action"].copy()
        position = np.empty((self.robots, len(self.contract.joints)))
        position[:, self.robot.support] = outputs["support_target"]
        position[:, self.robot.interaction] = self._references.arm_target(
            self._arms, self._support, self._command, self._load
        )
        return Targets(position, self._kp, self._kd, outputs["action"], outputs["support_reference"])

    def _advance(self, starts: NDArray[np.bool_]) -> None:
        """References and gait clock of this step; robots that start are settled in their grasp."""
        settings, dt = self.contract.references.gait, 1.0 / self.frequency
        moving = gait.wants_to_move(self._command, settings)
        arms, support = self._references.advance(self._arms, self._support, self._command, self._grasp, dt)
        phase, stepping = gait.advance(self._phase, self._stepping, moving, settings, dt)
        if starts.any():
            settled = self._references.start(self._command, self._grasp)
            arms, support = (
                np.where(starts[:, None], new, old) for new, old in zip(settled, (arms, support), strict=True)
            )
            phase, stepping = np.where(starts, 0.0, phase), stepping & ~starts
            self._inputs["last_action"][starts] = 0.0
        self._arms, self._support, self._phase, self._stepping = arms, support, phase, stepping

    def _support_reference(self, arms: Array, command: Array) -> Array:
        """θ_S_ref at rest, without the gait prior, from the generator inside the graph, (n, 15) [rad]."""
        outputs = self._run(self._inputs | self._as_inputs(command=command, arm_reference=arms))
        return np.asarray(outputs["support_reference"], np.float64)

    @staticmethod
    def _as_inputs(**values: NDArray[Any]) -> dict[str, NDArray[np.float32]]:
        return {name: np.array(value, np.float32) for name, value in values.items()}

    def _run(self, inputs: dict[str, NDArray[np.float32]]) -> dict[str, NDArray[np.float32]]:
        names = [port.name for port in self.contract.outputs]
        return dict(zip(names, self._session.run(names, inputs), strict=True))

    @staticmethod
    def _check(name: str, value: Array | None, shape: tuple[int, ...]) -> None:
        if value is None:
            raise ValueError(f"{name}: this policy needs it, with shape {shape}; got nothing")
        if np.shape(value) != shape:
            raise ValueError(f"{name}: expected shape {shape}, got {np.shape(value)}")
        if not np.isfinite(value).all():
            raise ValueError(f"{name}: not finite: {value}")


def open_session(path: Path) -> onnxruntime.InferenceSession:
    """A session on one thread: the graph is small, and a control loop shares its processor."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def base_grasp(grasps: Grasps, scene: str) -> tuple[float, float, float]:
    """The left wrist's base grasp in a scene [m]. Raises ValueError for a scene without one."""
    known = dict(grasps)
    if scene not in known:
        raise ValueError(f"no base grasp for scene {scene!r}; known: {', '.join(known)}")
    grasp: tuple[float, float, float] = known[scene]
    return grasp
