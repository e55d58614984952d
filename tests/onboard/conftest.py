"""The controllers that came with the repository."""

from pathlib import Path

import pytest
from still import Still

from iowbc.deploy.contract import read_contract
from iowbc.deploy.controller import Controller

PUBLISHED = Path(__file__).parents[2] / "runs" / "published" / "export"


def published(recipe: str) -> Path:
    folders = [graph.parent for graph in PUBLISHED.glob("*/step.onnx")]
    return next(folder for folder in folders if read_contract(folder).recipe == recipe)


@pytest.fixture(scope="session")
def blind() -> Path:
    """Folder of the blind controller's export."""
    return published("blind")


@pytest.fixture(scope="session")
def sighted() -> Path:
    """Folder of an export whose policy observes the object."""
    return published("full")


@pytest.fixture(scope="session")
def controller(blind: Path) -> Controller:
    """To be loaded once: a state machine resets it."""
    return Controller.load(blind)


@pytest.fixture
def still(controller: Controller) -> Still:
    return Still(controller)
