"""Exported controllers as policies in simulation: they read the simulated sensors, not the observation."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from iowbc.control.references import ReferenceLayer
from iowbc.deploy import contract, exported_folder
from iowbc.deploy.controller import Controller
from iowbc.errors import ContractBroken
from iowbc.recipe.recipe import Recipe
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv


def exported_world(folder: Path) -> Specification:
    """Specification with which an exported controller was accepted, from its folder alone. Raises ContractBroken if the
    folder does not match its contract."""
    controller = Controller.load(folder)
    said = controller.contract
    contract.require_sealed(said.files, folder / exported_folder.CONTRACT, exported_folder.RECIPE)
    path = folder / exported_folder.RECIPE
    try:
        recipe = Recipe.model_validate_json(path.read_bytes())
    except ValidationError as error:
        raise ContractBroken(f"{path}: not a recipe of this version: {error}; export again") from error
    generator = contract.generator_folder(said, folder)
    with contract.readable(folder / exported_folder.GENERATOR):
        ReferenceLayer(controller.robot, recipe.task.references, generator)
    with contract.readable(folder):
        return Specification(recipe.deployed, folder / exported_folder.ROBOT, generator)


class ExportedPolicy:
    """Exported controller as the policy of an in-process vector environment. `largest_difference`: of its joint targets
    from those that the environment computes from the action [rad]; it covers arm kinematics, reference generator, gait
    clock and scaling."""

    def __init__(self, controller: Controller, environment: VectorEnv, *, golden_steps: int = 0) -> None:
        """`golden_steps`: number of steps of the first environment to keep as golden vectors."""
        self.controller, self.environment = controller, environment
        self.golden_steps = golden_steps
        self.inputs: list[dict[str, NDArray[np.float32]]] = []
        self.largest_difference = 0.0

    def reset(self, which: NDArray[np.bool_]) -> None:
        scenes = self.environment.batch.scenes
        for scene in sorted(set(scenes[which])):
            self.controller.reset(which & (scenes == scene), scene=scene)

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        batch = self.environment.batch
        targets = self.controller.step(batch.simulation.measured, batch.memory.command)
        expected = batch.targets(targets.action)
        passed = np.abs(expected - targets.position)[~targets.held]
        self.largest_difference = max(self.largest_difference, float(passed.max(initial=0.0)))
        if len(self.inputs) < self.golden_steps:
            given = self.controller.inputs
            self.inputs.append({name: value[:1].copy() for name, value in given.items() if name != "state"})
        return targets.action
