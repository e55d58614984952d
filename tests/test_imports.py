"""Imports run one way through the rooms of the package, and only the command line sees everything."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import iowbc

PACKAGE = Path(iowbc.__file__).parent
GROUND = {"errors", "files", "arrays", "counter_random", "processes", "full_disk"}
"""Modules beside the rooms that any of them may use."""
DESCRIPTIONS = GROUND | {"recipe", "robot"}
SHARED = DESCRIPTIONS | {"control"}
WORLD = SHARED | {"sim"}
MAY_IMPORT = {
    "errors": set(),
    "files": {"errors"},
    "arrays": set(),
    "full_disk": set(),
    "processes": set(),
    "counter_random": {"recipe", "errors", "arrays"},
    "results": set(),
    "recipe": {"errors", "files"},
    "robot": GROUND - {"counter_random"},
    "control": DESCRIPTIONS,
    "deploy": SHARED,
    "onboard": SHARED | {"deploy"},
    "pipeline": {"recipe", "errors", "files", "processes", "full_disk"},
    "sim": SHARED,
    "reference": WORLD | {"results"},
    "model_based": SHARED | {"reference"},
    "adapters": SHARED | {"task", "deploy"},
    "rollouts": {"arrays"},
    "learning": SHARED | {"rollouts", "results"},
    "twin": WORLD | {"onboard"},
    "task": WORLD | {"rollouts"},
    "evaluation": WORLD | {"task", "reference", "learning", "rollouts", "deploy", "model_based", "adapters", "results"},
    "skill": WORLD | {"task", "rollouts", "learning", "evaluation", "results"},
    "live": WORLD | {"task", "reference", "learning", "deploy", "evaluation", "skill"},
    "benchmarks": WORLD | {"task", "reference", "learning", "deploy"},
    "export": WORLD | {"task", "reference", "learning", "deploy"},
    "report": {"learning", "pipeline", "recipe", "results", "stages", "errors", "files"},
    "web": WORLD | {"task", "deploy", "evaluation"},
    "stages": WORLD
    | {"task", "reference", "learning", "rollouts", "deploy", "pipeline", "evaluation", "benchmarks", "export"}
    | {"skill", "results"},
    "commands": WORLD
    | {"task", "reference", "learning", "deploy", "pipeline", "evaluation", "benchmarks", "export", "report"}
    | {"live", "web", "stages", "results", "onboard", "twin", "adapters", "skill"},
    "cli": {"commands", "errors", "processes"},
}
"""Which rooms a room may import, itself aside; `__init__` and `__main__` belong to whoever uses the package."""
ROBOT_FREE = {"torch", "mujoco", "pinocchio", "crocoddyl", "pandas", "scipy", "sklearn", "mlflow", "matplotlib"}
"""Packages that a robot's computer need not have."""


def imported(source: Path) -> Iterator[str]:
    """Dotted names of what a file imports, wherever in the file."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{source}: imports within the package are written in full"
            yield from (
                [f"iowbc.{alias.name}" for alias in node.names] if node.module == "iowbc" else [str(node.module)]
            )


def room(source: Path) -> str:
    return source.relative_to(PACKAGE).parts[0].removesuffix(".py")


SOURCES = [source for source in sorted(PACKAGE.rglob("*.py")) if not room(source).startswith("__")]


def test_every_room_has_its_rule() -> None:
    assert {room(source) for source in SOURCES} <= MAY_IMPORT.keys()


@pytest.mark.parametrize("name", sorted({room(source) for source in SOURCES}))
def test_a_room_imports_only_what_lies_below_it(name: str) -> None:
    upward = [
        f"{source.relative_to(PACKAGE.parent)} imports {module}"
        for source in SOURCES
        if room(source) == name
        for module in imported(source)
        if module.startswith("iowbc.") and module.split(".")[1] not in MAY_IMPORT[name] | {name}
    ]
    assert upward == []


@pytest.mark.parametrize("name", ["recipe", "control", "deploy", "onboard"])
def test_what_runs_on_the_robot_never_names_what_only_training_needs(name: str) -> None:
    heavy = [
        f"{source.relative_to(PACKAGE.parent)} imports {module}"
        for source in SOURCES
        if room(source) == name
        for module in imported(source)
        if module.split(".")[0] in ROBOT_FREE
    ]
    assert heavy == []


def test_the_viewer_in_the_browser_is_loaded_only_when_asked_for() -> None:
    named = {room(source) for source in SOURCES if any(module.startswith("viser") for module in imported(source))}
    assert named == {"live"}
    always = [
        str(source.relative_to(PACKAGE.parent))
        for source in SOURCES
        for node in ast.parse(source.read_text(encoding="utf-8")).body
        if room(source) != "live" and isinstance(node, ast.ImportFrom) and str(node.module).startswith("iowbc.live")
    ]
    assert always == []


def test_no_two_rooms_import_each_other() -> None:
    edges = {
        (room(source), module.split(".")[1])
        for source in SOURCES
        for module in imported(source)
        if module.startswith("iowbc.")
    }
    assert [edge for edge in edges if edge[0] < edge[1] and edge[::-1] in edges] == []
