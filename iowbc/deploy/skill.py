"""The exported skill, as it runs on a robot beside the controller: onnxruntime and NumPy, no torch and no simulator.

controller, skill = Controller.load("exported"), Skill.load("skill", controller)
command = skill.step(measured)                    # every 1 / controller.frequency seconds, and then
targets = controller.step(measured, command)
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Literal, Self

import numpy as np
import onnxruntime
from pydantic import Field

from iowbc.arrays import Array, Mask
from iowbc.control.command import approach, nominal_command, rate_limits
from iowbc.control.hand_forces import HandForces
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.control.sensors import Measured
from iowbc.control.skill_command import SkillCommand
from iowbc.control.skill_observation import SENSED, WAYPOINTS, YAW, of_object, robot_observation
from iowbc.deploy.contract import parsed, readable, require_sealed, require_unchanged
from iowbc.deploy.controller import Controller, base_grasp, open_session, require_traced, run
from iowbc.deploy.plausibility import WIDE, Plausibility
from iowbc.errors import ContractBroken
from iowbc.recipe.section import Section
from iowbc.recipe.skill.skill import RobotAgent
from iowbc.recipe.task.commands import Commands

GRAPH, CONTRACT, GOLDEN = "skill.onnx", "skill_contract.json", "skill_golden.npz"
"""Files of an exported skill. The graph maps `observation` (n, size) to `action` (n, 11)."""
FILES = (GRAPH, GOLDEN)


class SkillContract(Section):
    """Content of `skill_contract.json`."""

    format: Literal[1] = 1
    """Raised when a reader of the old format would misread the new one."""
    frequency: float = Field(gt=0)
    """Decision rate [Hz]; divides the controller's frequency."""
    observation: int = Field(ge=1)
    """Size of the observation: see `iowbc.control.skill_observation.robot_observation`."""
    sees_object: bool
    """True if the robot measures the object's pose."""
    robot: RobotAgent
    """Admittance, scales of the action, and length of the history of forces."""
    commands: Commands
    """Ranges of the command."""
    sources: dict[str, str]
    """Artifact keys of the stages that the skill was trained with; `distill` is the controller's student."""
    versions: dict[str, str]
    """Versions of the packages that made the graph."""
    files: dict[str, str] = Field(default_factory=dict)
    """SHA-256 of the other files, by name."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.observation != (size := SENSED + 6 * self.robot.history):
            yield "", f"observation: {self.observation}, with robot.history {self.robot.history} it is {size}"


def read_skill_contract(folder: Path) -> SkillContract:
    """Contract of a complete and unchanged exported skill. Raises ContractBroken."""
    contract = parsed(SkillContract, folder / CONTRACT, "skill")
    require_sealed(contract.files, folder / CONTRACT, *FILES)
    require_unchanged({name: contract.files[name] for name in FILES}, folder)
    return contract


class Skill:
    """Commands of the skill layer for a controller's robots, in games whose goal only the partner knows."""

    def __init__(
        self,
        contract: SkillContract,
        session: onnxruntime.InferenceSession,
        controller: Controller,
        scene: str,
        pushing: bool,
    ) -> None:
        n = controller.robots
        self._references = ReferenceLayer(controller.robot, controller.contract.references, None)
        self.contract, self._session, self._controller = contract, session, controller
        self._every = round(controller.frequency / contract.frequency)
        self._grasp = np.tile(both_wrists(base_grasp(controller.contract.references.grasps, scene)), (n, 1, 1))
        self._largest_step = rate_limits(contract.commands.rates) / controller.frequency
        self._pushing: Mask = np.full(n, pushing)
        self._rule = SkillCommand(contract.robot, contract.commands, self._pushing)
        self._plausibility = Plausibility(controller.contract, WIDE, n)
        self.observation = np.zeros((n, contract.observation), np.float32)
        """Last observation of the skill, (n, size)."""
        self.reset()

    @classmethod
    def load(cls, folder: Path | str, controller: Controller, *, scene: str = "lift", pushing: bool = False) -> Self:
        """The skill in the artifact of the stage `skill`, for the robots of a controller. `scene`: selects the base
        grasp; `pushing`: true with a crate in front of the robots. Raises ContractBroken if the folder does not match
        its contract or belongs to another controller."""
        folder = Path(folder)
        contract = read_skill_contract(folder)
        both = (contract.sources, controller.contract.sources)
        own, other = (sources.get("distill", sources.get("teacher")) for sources in both)
        if own != other:
            raise ContractBroken(f"{folder}: trained with the student {own}, the controller has {other}; export both")
        if (ratio := controller.frequency / contract.frequency) != round(ratio):
            raise ContractBroken(f"{folder}: {contract.frequency} Hz is no whole part of {controller.frequency} Hz")
        with readable(folder / GRAPH):
            session = open_session(folder / GRAPH)
            require_traced(session, contract, folder / CONTRACT, GRAPH)
            sizes = [tuple(port.shape[1:]) for port in (*session.get_inputs(), *session.get_outputs())]
        if sizes != [(contract.observation,), (len(nominal_command(contract.commands)),)]:
            raise ContractBroken(f"{folder / GRAPH}: shapes are {sizes}, not those of the contract; export again")
        return cls(contract, session, controller, scene, pushing)

    def reset(self) -> None:
        n = self._controller.robots
        self._hands = HandForces(self._controller.robot, self._references, n, self.contract.robot.history)
        self._wrist_error = np.zeros((n, 2, 3))
        self._passed = 0
        self._yaw: Array | None = None
        self._command = self._rule.standing()

    def step(self, measured: Measured) -> Array:
        """Commands C, (n, 11), for the next control period; a decision takes effect one period later, as in training. A
        robot with an implausible measurement is taken to be where the controller last saw it; a decision that is not
        finite keeps the command. Raises ValueError for a missing quantity."""
        measured = self._plausible(measured)
        if self._yaw is not None:
            action = run(self._session, {"observation": self.observation})["action"]
            nominal = self._rule.following(self._hands.felt[:, -1].sum(axis=1), self._yaw)
            decided = self._rule.with_action(nominal, action)
            whole: Mask = np.asarray(np.isfinite(decided).all(axis=1))[:, None]
            self._command = np.where(whole, decided, self._command)
        if self._passed:
            self._hands.add(self._controller.targets, measured.joint_position, measured.joint_velocity)
        self._yaw = self._sense(measured) if self._passed % self._every == 0 else None
        self._passed += 1
        return self._command.copy()

    def _plausible(self, measured: Measured) -> Measured:
        """The measurements, with the last ones that the controller used where a robot's are not plausible."""
        values = {name: getattr(measured, name) for name in self._plausibility.names if name != "command"}
        if not self._controller.inputs or any(value is None for value in values.values()):
            return measured
        given = {name: np.array(value, np.float64) for name, value in values.items()}
        with np.errstate(over="ignore", invalid="ignore"):
            refused = [*self._plausibility.refusals(given | {"command": self._command}, None)]
        for name, value in given.items():
            value[refused] = self._controller.inputs[name][refused]
        return replace(measured, **given)

    def _sense(self, measured: Measured) -> Array:
        """Observes for the decision of the next step, to spread the work; yaw of the objects, (n,) [rad]."""
        command, thing = self._command, of_object(measured, self.contract.sees_object)
        if self._passed:
            state = self._controller.state
            posture, last = (state[name].astype(np.float64) for name in ("posture", "command"))
            wrists = self._hands.read(measured.projected_gravity)
            self._wrist_error = wrists - self._references.wrist_target(posture, last, self._grasp)
            command = approach(last, command, self._largest_step)
        n = len(command)
        unknown, no_path = np.zeros(n, np.bool_), np.zeros((n, WAYPOINTS))
        self.observation = robot_observation(
            command, measured, self._wrist_error, thing, self._pushing, unknown, no_path, self._hands.felt
        )
        return thing[:, YAW]
