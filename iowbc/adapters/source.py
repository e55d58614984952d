"""From what a recipe says of a public controller to its adapter: the file's place, its digest, and the module."""

import hashlib
from importlib.util import find_spec
from pathlib import Path

from iowbc.adapters import deploy, holosoma
from iowbc.adapters.adapter import Adapter, require_fitting
from iowbc.adapters.robot import robot_of
from iowbc.errors import StageFailed
from iowbc.files import file_digest
from iowbc.recipe.beside import OwnFunction
from iowbc.recipe.evaluation.rivals import PublicController
from iowbc.recipe.task.task import Task
from iowbc.robot.description import Robot
from iowbc.task.own_function import load_function

SHIPPED = {"holosoma": holosoma.adapter, "deploy": deploy.adapter}
PLACE = "eval.public"
CONTRACT = "it takes the controller's pathlib.Path and returns an iowbc.adapters.adapter.Adapter"


def load_adapter(controller: PublicController) -> Adapter:
    """The adapter of a public controller whose file is the one of the digest.

    Raises StageFailed where the file or its package is not there, is another one, or cannot be described.
    """
    policy = policy_path(controller.policy)
    found = policy_digest(policy)
    if found != controller.sha256:
        text = f"has the SHA-256 {found}, the recipe expects {controller.sha256}"
        raise StageFailed(f"{PLACE}.policy: {policy}: {text}; correct {PLACE}.sha256 if this is the file you mean")
    if controller.module is None:
        return SHIPPED[controller.adapter](policy)
    own = load_function(f"{PLACE}.module", OwnFunction(module=controller.module, function="adapter"), CONTRACT)
    try:
        made = own.function(policy)
    except StageFailed:
        raise
    except Exception as error:
        raise StageFailed(f"{own.where}: raised {type(error).__name__}: {error}; {CONTRACT}") from error
    if not isinstance(made, Adapter):
        raise StageFailed(f"{own.where}: returned {type(made).__name__}; {CONTRACT}")
    return made


def adapted_robot(controller: PublicController, robot: Robot, task: Task) -> Path:
    """A folder with the robot that has the controller's gains and default posture. Raises StageFailed where the
    controller cannot be used, or does not fit the robot."""
    adapter = load_adapter(controller)
    require_fitting(adapter, robot, task.control_frequency, PLACE, moves_arms=controller.moves_arms)
    return robot_of(adapter, robot, PLACE, moves_arms=controller.moves_arms)


def policy_path(named: str) -> Path:
    """The file or folder of a controller: a path, or PACKAGE:PATH of an installed package, which is not imported.

    Raises StageFailed.
    """
    package, colon, inside = named.partition(":")
    path = Path(named)
    if colon:
        spec = find_spec(package) if package.isidentifier() else None
        if spec is None or spec.origin is None:
            brings = "; `pip install 'iowbc[public]'` brings it" if package == "holosoma_inference" else ""
            raise StageFailed(f"{PLACE}.policy: needs the package {package}, which is not installed{brings}")
        path = Path(spec.origin).parent / inside
    if not path.exists():
        raise StageFailed(f"{PLACE}.policy: {path}: is not there; give the controller's file or folder")
    return path


def policy_digest(path: Path) -> str:
    """SHA-256 of a file; of a folder that of the sorted lines `DIGEST  NAME` of all files below it, hexadecimal."""
    if path.is_file():
        return file_digest(path)
    files = [file for file in path.rglob("*") if file.is_file()]
    lines = sorted(f"{policy_digest(file)}  {file.relative_to(path).as_posix()}\n" for file in files)
    return hashlib.sha256("".join(lines).encode()).hexdigest()
