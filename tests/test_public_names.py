"""The names of the package are found where they are promised, and cost nothing until they are used."""

import subprocess
import sys

import pytest

import iowbc


def python(script: str) -> str:
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.parametrize("name", iowbc.__all__)
def test_a_public_name_is_there_and_has_a_docstring(name: str) -> None:
    assert getattr(iowbc, name).__doc__


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(AttributeError, match="no attribute 'controller'; it has: Artifact, Controller"):
        _ = iowbc.controller


def test_importing_the_package_imports_nothing_else() -> None:
    script = "import sys, typing, importlib; a = set(sys.modules); import iowbc; print(sorted(set(sys.modules) - a))"
    assert python(script) == "['iowbc']"


def test_what_runs_on_a_robot_and_reads_artifacts_needs_nothing_that_trains() -> None:
    script = """
import sys
TRAINING = {"torch", "mujoco", "pinocchio", "crocoddyl", "pandas", "scipy", "mlflow", "matplotlib"}
class Nothing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in TRAINING:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Nothing())
import iowbc
print(iowbc.Controller.__name__, iowbc.Measured.__name__, iowbc.load_recipe.__name__, iowbc.open_artifact.__name__)
"""
    assert python(script) == "Controller Measured load_recipe open_artifact"
