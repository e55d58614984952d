"""Adapter of a recipe's public controller (file, digest, module), and the robot description it requires."""

import atexit
import functools
import hashlib
import shutil
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import yaml

from iowbc.adapters import deploy, holosoma
from iowbc.adapters.adapter import PLACE, Adapter, validate_adapter
from iowbc.errors import StageFailed
from iowbc.files import file_digest
from iowbc.recipe.beside import CustomFunction
from iowbc.recipe.evaluation.baselines import PublicController
from iowbc.recipe.task.task import Task
from iowbc.robot.description import DESCRIPTION, Robot, kind_of, side_sign
from iowbc.task.own_function import load_function

SHIPPED = {"holosoma": holosoma.adapter, "deploy": deploy.adapter}
CONTRACT = "it takes the controller's pathlib.Path and returns an iowbc.adapters.adapter.Adapter"


def load_adapter(controller: PublicController) -> Adapter:
    """The adapter of a public controller. Raises StageFailed if its file or package is missing, the file's digest
    differs, or no adapter can be made."""
    policy = policy_path(controller.policy)
    found = policy_digest(policy)
    if found != controller.sha256:
        text = f"has the SHA-256 {found}, the recipe expects {controller.sha256}"
        raise StageFailed(f"{PLACE}.policy: {policy}: {text}; correct {PLACE}.sha256 if this is the file you mean")
    if controller.module is None:
        return SHIPPED[controller.adapter](policy)
    own = load_function(f"{PLACE}.module", CustomFunction(module=controller.module, function="adapter"), CONTRACT)
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
    """Folder with a robot description that has the controller's gains and default posture. Raises StageFailed if the
    controller cannot be used or does not fit the robot."""
    adapter = load_adapter(controller)
    validate_adapter(adapter, robot, task.control_frequency, moves_arms=controller.moves_arms)
    return robot_of(adapter, robot, moves_arms=controller.moves_arms)


def robot_of(adapter: Adapter, robot: Robot, *, moves_arms: bool = False) -> Path:
    """Folder, until the process exits, with the robot's description in which legs and waist have the controller's gains
    and default posture, and arms its gains only if it moves them. Raises StageFailed if left and right differ, since
    they share one row of the description."""
    entries = yaml.safe_load((robot.folder / DESCRIPTION).read_text(encoding="utf-8"))
    rows = entries["joints"]
    for index in [*robot.support, *(robot.interaction if moves_arms else ())]:
        name = robot.joints[index]
        place, row = adapter.joints.index(name), rows[kind_of(name)]
        own = {"kp": adapter.kp[place], "kd": adapter.kd[place]}
        if index in robot.support:
            own["default"] = side_sign(row, name) * adapter.default[place]
        known = row.setdefault("own", own)
        if any(not np.isclose(known[key], own[key]) for key in own):
            raise StageFailed(f"{PLACE}: {name} differs from the other side in kp, kd or default; both should be alike")
    for row in rows.values():
        row |= {key: float(value) for key, value in row.pop("own", {}).items()}
    return _folder(robot.folder, yaml.safe_dump(entries))


@functools.cache
def _folder(source: Path, description: str) -> Path:
    made = Path(tempfile.mkdtemp(prefix="iowbc-robot-"))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    shutil.copytree(source, made, dirs_exist_ok=True)
    (made / DESCRIPTION).write_text(description, encoding="utf-8")
    return made


def policy_path(named: str) -> Path:
    """The file or folder of a controller: a path, or PACKAGE:PATH of an installed package, which is not imported.
    Raises StageFailed."""
    package, colon, inside = named.partition(":")
    path = Path(named)
    if colon:
        spec = find_spec(package) if package.isidentifier() else None
        if spec is None or spec.origin is None:
            brings = "; `pip install '.[public]'` in a checkout brings it" if package == "holosoma_inference" else ""
            raise StageFailed(f"{PLACE}.policy: needs the package {package}, which is not installed{brings}")
        path = Path(spec.origin).parent / inside
    if not path.exists():
        raise StageFailed(f"{PLACE}.policy: {path}: is not there; give the controller's file or folder")
    return path


def policy_digest(path: Path) -> str:
    """SHA-256 of a file, hexadecimal; for a folder, of the sorted lines `DIGEST  NAME` of all files below it. Raises
    StageFailed for an ONNX file whose weights are in another file."""
    if path.is_file():
        if path.suffix == ".onnx" and _has_external_weights(path):
            text = "keeps weights in another file, which its digest would not cover; save it as one file"
            raise StageFailed(f"{PLACE}.policy: {path}: {text}")
        return file_digest(path)
    files = [file for file in path.rglob("*") if file.is_file()]
    lines = sorted(f"{file_digest(file)}  {file.relative_to(path).as_posix()}\n" for file in files)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def _has_external_weights(path: Path) -> bool:
    import onnx
    from onnx.external_data_helper import uses_external_data

    try:
        graph = onnx.load(path, load_external_data=False).graph
    except Exception:  # no ONNX file, which its adapter reports
        return False
    return any(uses_external_data(weights) for weights in graph.initializer)
