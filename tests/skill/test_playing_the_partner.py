"""A person plays the human: the mouse leads a spring of bounded force, and a released mouse pulls nowhere."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
import torch

from iowbc.arrays import Array
from iowbc.errors import UsageError
from iowbc.learning.networks import TeacherNetwork
from iowbc.live.drag import Drag
from iowbc.live.game import ROBOTS, GamePanel, GameSession
from iowbc.live.page import SETTLED, Page
from iowbc.live.server import serving
from iowbc.sim.rendering import appearance
from iowbc.skill.episodes import PERSON, Plan, Rule
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

ABOVE = np.array([-1.0, -1.5, 1.5])
"""Of the camera from the point that is held [m]."""


@pytest.fixture
def start(
    world: Specification, student: Student, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., GameSession]]:
    """Begins sessions, with a robot that stands unless the request names another."""
    monkeypatch.setattr(appearance, "installed_meshes", lambda robot: iter(()))
    torch.manual_seed(0)
    skill = TeacherNetwork(44 + 6 * world.recipe.skill.robot.history, 11, [8], "elu", 5.0).requires_grad_(False)
    begun: list[GameSession] = []

    def starter(task: str = "lift_straight", rule: Rule | None = "stand", seed: int = 1, **held: float) -> GameSession:
        plan = Plan(task, PERSON, known=False, seed=seed, rule=rule, **held)
        begun.append(GameSession(world, student, skill, plan))
        return begun[-1]

    yield starter
    for session in begun:
        session.close()


def handle(session: GameSession) -> Array:
    position: Array = session._lower.simulation.partner.at[0]
    return position


def pull(session: GameSession) -> Array:
    force: Array = session._lower.simulation.state.partner_force[0]
    return force.copy()


def dragged(session: GameSession, way: Array, steps: int, shift: bool = False, body: str = "object") -> Array:
    """The pull after some steps in which the pointer stays `way` (3,) [m] from where the handle was."""
    held = handle(session)
    end = held + np.asarray(way, np.float64)
    for _ in range(steps):
        session.drag([Drag(body, held, end, held + ABOVE, shift)])
        session.step()
    return pull(session)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (-0.6, -0.8)])
def test_a_drag_moves_the_spring_to_the_pointer_and_pulls_there(
    start: Callable[..., GameSession], direction: tuple[float, float]
) -> None:
    ends, forces = [], []
    for sign in (1.0, -1.0):
        session = start()
        before = handle(session)
        forces.append(dragged(session, 0.1 * sign * np.array([*direction, 0.0]), 15))
        ends.append(session._lower.simulation.partner.aim[0] - before)
    np.testing.assert_allclose(ends[0][:2], 0.09 * np.array(direction), atol=0.015)
    along, aside = direction, (-direction[1], direction[0])
    apart = (forces[0] - forces[1])[:2]
    assert np.dot(apart, along) > max(5.0, 2.0 * abs(np.dot(apart, aside)))
    force = forces[1]
    arrow = session.track.moments[-1].forces[0]
    assert (arrow.kind, arrow.force[2]) == ("partner", 0.0)
    np.testing.assert_array_equal(arrow.force[:2], force[:2])


def test_mass_and_share_stay_as_asked_in_the_next_game(start: Callable[..., GameSession]) -> None:
    session = start(mass=2.5, share=0.25)
    with serving(0) as server:
        panel = GamePanel(server.gui, session, ())
        panel.press("next task")
        session.begin(panel.conditions)
    drawn = session._lower.simulation.drawn
    assert (session.request.task, drawn["object_mass"][0], drawn["partner_share"][0]) == ("lift_corridor", 2.5, 0.25)


def test_the_force_is_bounded_however_far_the_pointer_is(start: Callable[..., GameSession]) -> None:
    session = start("push_straight")
    drawn, human = session._lower.simulation.drawn, session.world.recipe.skill.human
    bound = human.strongest + (drawn["partner_share"] * drawn["rolling_resistance"])[0]
    forces = [np.linalg.norm(dragged(session, [50.0, 0.0, 0.0], 1)[:2]) for _ in range(30)]
    assert 0.5 * bound < max(forces) <= bound + 1e-9


def test_a_released_handle_is_pulled_nowhere_and_its_share_of_the_weight_still_borne(
    start: Callable[..., GameSession],
) -> None:
    session = start()
    weight = 9.81 * float(session._lower.simulation.drawn["object_mass"][0])
    share = float(session._lower.simulation.drawn["partner_share"][0])
    dragged(session, [0.2, 0.1, 0.0], 10)
    assert np.linalg.norm(pull(session)[:2]) > 3.0
    for _ in range(10):
        session.drag([])
        session.step()
        assert not pull(session)[:2].any()
    assert pull(session)[2] == pytest.approx(share * weight, rel=0.5)


def test_with_the_shift_key_the_handle_is_raised_and_not_pulled_along(start: Callable[..., GameSession]) -> None:
    session = start()
    dragged(session, np.zeros(3), 1)
    height = session._lower.simulation.partner.aim[0].copy()
    dragged(session, [0.3, 0.0, 0.1], 25, shift=True)
    raised = session._lower.simulation.partner.aim[0] - height
    assert raised[2] == pytest.approx(session.world.recipe.skill.human.vertical_velocity * 0.5, rel=0.1)
    assert np.abs(raised[:2]).max() < 0.05


@pytest.mark.parametrize("eye", [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
def test_a_pointer_above_the_horizon_or_on_the_robot_leads_nowhere(
    start: Callable[..., GameSession], eye: list[float]
) -> None:
    session = start()
    held = handle(session)
    for body in ("object", "pelvis"):
        session.drag([Drag(body, held, held + np.array([0.0, 0.0, 1e-12]), held + np.array(eye), False)])
        session.step()
    assert np.isfinite(session.track.moments[-1].bodies).all()
    assert np.linalg.norm(pull(session)[:2]) < 3.0


def test_a_game_that_ends_rests_until_it_is_begun_again(start: Callable[..., GameSession]) -> None:
    session = start()
    first = session.track.moments[0].bodies.copy()
    session._game.batch._skill = session._game.batch._skill.model_copy(
        update={"finish": session.world.recipe.skill.finish.model_copy(update={"distance": 10.0})}
    )
    for _ in range(session._game.batch.substeps + 3):
        session.step()
    assert session.track.ending == "success"
    assert len(session.track.moments) == session._game.batch.substeps + 1
    session.reset()
    assert session.track.ending == ""
    np.testing.assert_array_equal(session.track.moments[0].bodies, first)


def test_the_robots_to_compare_command_differently_in_the_same_game(start: Callable[..., GameSession]) -> None:
    commands, starts = [], []
    for rule in ROBOTS.values():
        session = start(rule=rule)
        starts.append(session.track.moments[0].bodies)
        dragged(session, [0.15, 0.0, 0.0], 30)
        commands.append(tuple(session._lower.wanted[0, :3]))
    assert len(set(commands)) == 3
    assert commands[2] == (0.0, 0.0, 0.0)
    np.testing.assert_array_equal(starts[0], starts[2])


def test_a_page_plays_the_tasks_one_after_another(start: Callable[..., GameSession]) -> None:
    session = start("lift_straight")
    with serving(0) as server:
        page = Page(server, session, panel=GamePanel)
        for step in range(5):
            page.turn(10.0 + 0.02 * step)
        assert len(page.drawing._marks) >= 1
        assert "your pull" in page.panel.figures.content
        page.panel._pressed.put("next task")
        for now in (10.2, 10.3 + SETTLED, 10.4 + SETTLED):
            page.turn(now)
        assert session.request.task == "lift_corridor"
        assert len(page.drawing._marks) >= 3


def test_an_unknown_task_is_refused(start: Callable[..., GameSession]) -> None:
    with pytest.raises(UsageError, match=r"lift_strait: no such transport task.*lift_straight"):
        start("lift_strait")
