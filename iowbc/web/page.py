"""Writes the folder of a web page from an exported folder."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

from iowbc.deploy import exported_folder
from iowbc.evaluation.exported import exported_world
from iowbc.robot.description import load_robot
from iowbc.web.bundling import bundle, npm_parts
from iowbc.web.scenes import first_scene, web_scenes

SCENES = "scenes.json"
"""The page's addition to the exported files: scenes, and the names of the files that it has."""


def write_page(exported: Path, out: Path, cache: Path, say: Callable[[str], None]) -> None:
    """Write a page with the controller of an exported folder into `out`, which holds all that it needs.

    `cache`: where npm's packages are kept. Raises ContractBroken for a damaged export, UsageError without npm.
    """
    parts = npm_parts(cache, say)
    world = exported_world(exported)
    out.mkdir(parents=True, exist_ok=True)
    golden = [exported_folder.GOLDEN] if (exported / exported_folder.GOLDEN).is_file() else []
    for name in (exported_folder.SETTLE, exported_folder.STEP, exported_folder.CONTRACT, *golden):
        shutil.copyfile(exported / name, out / name)
    robot = load_robot(world.robot)
    about = {
        "scenes": web_scenes(world, robot),
        "first": first_scene(world.recipe),
        "golden": exported_folder.GOLDEN if golden else None,
    }
    (out / SCENES).write_text(json.dumps(about, separators=(",", ":")), encoding="utf-8")
    bundle(parts, out)
