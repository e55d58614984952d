"""The robot that most tests are about, and a smaller one; and that what tests start hears its signals."""

import signal
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
import yaml
from xdist.scheduler import LoadFileScheduling

from iowbc.robot.description import DESCRIPTION, Robot, load_robot, robot_folder

TIERS = {
    "unit": {"control", "deploy", "learning", "onboard", "recipe", "report", "robot", "rollouts", "sim"},
    "integration": {"evaluation", "export", "live", "reference", "skill", "stages", "task"},
    "system": {"chaos", "commands", "pipeline", "web"},
}
"""Folders of each tier; a file may choose another by its `pytestmark`, and one beside the folders is a unit test."""
RAY = {
    *("tests/commands/test_smoke.py", "tests/pipeline/test_actor_pool.py", "tests/pipeline/test_cluster.py"),
    *("tests/pipeline/test_cluster_parts.py", "tests/stages/test_training_stages.py"),
}
"""Files whose tests start clusters, of which a machine has one at a time."""
STIFF = ("waist_roll", "waist_pitch", "wrist_pitch", "wrist_yaw")
"""Joints that the robot of 29 joints has and the one of 23 has not."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give each test its tier."""
    for item in items:
        if not any(item.get_closest_marker(tier) for tier in TIERS):
            folder = item.path.relative_to(Path(__file__).parent).parts[0]
            item.add_marker(next((tier for tier, folders in TIERS.items() if folder in folders), "unit"))


class Scheduling(LoadFileScheduling):  # type: ignore[misc]
    """The tests of a file follow each other in one process, and so do all that start clusters."""

    def _split_scope(self, nodeid: str) -> str:
        file = str(super()._split_scope(nodeid))
        return "ray" if file in RAY else file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Scheduling:
    """Which process has which tests."""
    return Scheduling(config, log)


@pytest.fixture(scope="session", autouse=True)
def signals_are_heard() -> None:
    """In a background job or under nohup, what the tests start would inherit that signals are ignored."""
    for number, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, usual)


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_robot(robot_folder("g1"))


@pytest.fixture(scope="session")
def robot_of_23(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """The G1 of 23 joints: no roll and pitch in the waist, no pitch and yaw in the wrists."""
    source, folder = robot_folder("g1"), tmp_path_factory.mktemp("robots") / "g1_23"
    folder.mkdir()
    tree = ElementTree.parse(source / "g1.xml")
    for body in tree.iter("body"):
        for joint in body.findall("joint"):
            if any(kind in joint.attrib["name"] for kind in STIFF):
                body.remove(joint)
    tree.write(folder / "g1.xml")
    entries = yaml.safe_load((source / DESCRIPTION).read_text())
    entries["name"] = "g1_23"
    entries["support"] = [name for name in entries["support"] if name.removesuffix("_joint") not in STIFF]
    entries["joints"] = {kind: row for kind, row in entries["joints"].items() if kind not in STIFF}
    entries["linkages"] = [
        pair for pair in entries["linkages"] if not {name.removesuffix("_joint") for name in pair} & set(STIFF)
    ]
    (folder / DESCRIPTION).write_text(yaml.safe_dump(entries))
    return load_robot(folder)
