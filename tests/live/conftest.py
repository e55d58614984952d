"""A robot that is left to its reference, to be driven by hand, drawn by its primitive shapes."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from exported_policies import made_up_generator
from standing_still import StandingStill

from iowbc.control.command import nominal_command
from iowbc.evaluation.play import Source
from iowbc.evaluation.play_request import PlayRequest
from iowbc.live import session as driven
from iowbc.live.page import Page
from iowbc.live.server import serving
from iowbc.live.session import Session
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot, robot_folder
from iowbc.sim.rendering import appearance
from iowbc.task.specification import Specification


@pytest.fixture(scope="session")
def source(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Source:
    rg = made_up_generator(robot, tmp_path_factory.mktemp("rg"))
    policy: Path = tmp_path_factory.mktemp("policy") / "training.checkpoint"
    policy.write_bytes(b"1")
    return Source(Specification(Recipe(name="test"), robot_folder("g1"), rg), policy)


@pytest.fixture(scope="session")
def opened(source: Source) -> Iterator[Session]:
    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(appearance, "installed_meshes", lambda robot: iter(()))
        changed.setattr(driven, "open_policy", lambda source, environment: StandingStill())
        with closing(Session(source, PlayRequest(mass=4.0))) as session:
            yield session


@pytest.fixture
def session(opened: Session) -> Session:
    """At the start of an episode with 4 kg, told to stand, let alone."""
    opened.wanted[:] = nominal_command(opened.source.world.recipe.task.commands)
    opened.drag(())
    opened.begin(PlayRequest(mass=4.0)) if opened.request.mass != 4.0 else opened.reset()
    return opened


@pytest.fixture
def page(session: Session) -> Iterator[Page]:
    with serving(0) as server:
        yield Page(server, session)
