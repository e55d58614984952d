"""A robot as a public controller expects it: its gains and default posture in the support branch."""

import atexit
import functools
import shutil
import tempfile
from pathlib import Path

import numpy as np
import yaml

from iowbc.adapters.adapter import Adapter
from iowbc.errors import StageFailed
from iowbc.robot.description import DESCRIPTION, Robot, kind_of, side_sign


def robot_of(adapter: Adapter, robot: Robot, where: str, *, moves_arms: bool = False) -> Path:
    """A folder with the robot's description in which legs and waist have the controller's gains and default posture.

    Arms keep theirs, or take the controller's gains where it moves them. The folder lasts as long as the process.
    Raises StageFailed where left and right differ, for both have one row in a description.
    """
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
            raise StageFailed(f"{where}: {name} differs from the other side in kp, kd or default; both should be alike")
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
