"""The gait prior: a stride that a rigid leg can make."""

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import fsolve

from iowbc.control.legs import leg_joints
from iowbc.control.observation import observation_layout
from iowbc.control.stride import Stride, travel
from iowbc.recipe.task.joint_references import GaitPrior
from iowbc.robot.description import Robot
from iowbc.robot.mirror import support_mirror

PRIOR = GaitPrior()
PHASES = np.linspace(0.0, 1.0, 120, endpoint=False)
COMMANDS = {
    "in place": (0.0, 0.0, 0.0),
    "forward": (0.5, 0.0, 0.0),
    "backward": (-0.3, 0.0, 0.0),
    "to the left": (0.0, 0.2, 0.0),
    "turning": (0.0, 0.0, 0.4),
    "all at once": (0.4, 0.1, 0.3),
}
CROUCHES = {0.5: 0.13, 0.65: 0.05, 0.75: 0.0}
"""Heights, and how far ahead of the pelvis soles are flat with ankles in their range [m]."""


@pytest.fixture(scope="module")
def stride(robot: Robot) -> Stride:
    return Stride(robot, PRIOR)


def sole(robot: Robot, posture: Any, side: int, pitch: float) -> tuple[Any, Any]:
    """Place and rotation of a sole in the heading frame at the base, for one row of support joints."""
    joints = dict(zip(robot.joints, robot.default_position, strict=True))
    joints |= {robot.joints[joint]: value for joint, value in zip(robot.support, posture, strict=True)}
    position, rotation = robot.tree.forward(joints, robot.base, robot.soles[side])
    cosine, sine = np.cos(pitch), np.sin(pitch)
    upright = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    return upright @ position, upright @ rotation


def crouch(robot: Robot, height: float, ahead: float, pitch: float) -> Any:
    """Support joints with both soles flat, a height below the base and some way ahead of it."""
    posture = np.zeros(len(robot.support))
    for side, leg in enumerate(leg_joints(robot)):

        def off(bend: Any, side: int = side, leg: list[int] = leg) -> Any:
            posture[leg[0]], posture[leg[3]], posture[leg[4]] = bend[0], bend[1], -bend[0] - bend[1] - pitch
            place, _ = sole(robot, posture, side, pitch)
            return place[2] + height, place[0] - ahead

        off(fsolve(off, [-0.5 - pitch, 1.0]))
    return posture


def walk(robot: Robot, stride: Stride, posture: Any, pitch: float, velocity: Any) -> tuple[Any, Any, Any]:
    """Joints (phases, support joints), places (phases, 2, 3) and rotations of the soles over a stride."""
    command = np.zeros((len(PHASES), 11))
    command[:, :3] = velocity
    rows, ones = np.tile(posture, (len(PHASES), 1)), np.ones(len(PHASES))
    joints = stride(rows, pitch * ones, command, PHASES, ones)
    soles = [[sole(robot, row, side, pitch) for side in range(2)] for row in joints]
    return joints, np.array([[s[0] for s in row] for row in soles]), np.array([[s[1] for s in row] for row in soles])


def feet() -> Any:
    return np.stack([PHASES, (PHASES + 0.5) % 1.0], axis=1)


@pytest.mark.parametrize("velocity", COMMANDS.values(), ids=COMMANDS)
@pytest.mark.parametrize("pitch", [0.0, 0.25])
@pytest.mark.parametrize("height", CROUCHES)
def test_swinging_soles_clear_the_ground_and_standing_ones_stay_on_it(
    robot: Robot, stride: Stride, height: float, pitch: float, velocity: Any
) -> None:
    posture = crouch(robot, height, CROUCHES[height], pitch)
    joints, soles, _ = walk(robot, stride, posture, pitch, velocity)
    rise, standing = soles[:, :, 2] + height, feet() < PRIOR.stance
    assert np.abs(rise[standing]).max() < 0.01
    assert rise.max(axis=0) == pytest.approx(PRIOR.swing_clearance, rel=0.2)
    assert (joints >= robot.lower[robot.support]).all()
    assert (joints <= robot.upper[robot.support]).all()


@pytest.mark.parametrize("velocity", COMMANDS.values(), ids=COMMANDS)
def test_a_standing_foot_stays_where_it_is_while_the_robot_moves_as_commanded(robot: Robot, velocity: Any) -> None:
    still = Stride(robot, PRIOR.model_copy(update={"sway": 0.0}))
    _, soles, rotations = walk(robot, still, crouch(robot, 0.7, 0.02, 0.0), 0.0, velocity)
    period, standing = 1.0 / PRIOR.frequency, PRIOR.stance > PHASES
    time, left = PHASES[standing] * period, soles[standing, 0]
    moved = np.polyfit(time, left[:, :2], 1)[0]
    turning = np.polyfit(time, np.arctan2(rotations[standing, 0, 1, 0], rotations[standing, 0, 0, 0]), 1)[0]
    place = left.mean(axis=0)
    expected = np.array([velocity[0] - velocity[2] * place[1], velocity[1] + velocity[2] * place[0]])
    assert moved == pytest.approx(-expected, abs=0.02)
    assert turning == pytest.approx(-velocity[2], abs=0.08)


def test_feet_leave_and_meet_the_ground_at_its_own_speed() -> None:
    step = 1e-6
    for edge in (PRIOR.stance, 1.0):
        around = np.array([[edge - step], [edge], [edge + step]]) % 1.0
        swing = ((around - PRIOR.stance) / (1.0 - PRIOR.stance)).clip(0.0, 1.0)
        place = travel(around, swing, PRIOR.stance)[:, 0]
        assert np.diff(place) / step == pytest.approx([-1.0 / PRIOR.stance] * 2, rel=1e-3)


def test_the_pelvis_sways_over_the_standing_foot(robot: Robot, stride: Stride) -> None:
    _, soles, _ = walk(robot, stride, crouch(robot, 0.7, 0.02, 0.0), 0.0, (0.0, 0.0, 0.0))
    middle = soles[:, :, 1].mean(axis=1)
    quarter = len(PHASES) // 4
    assert -middle[quarter] == pytest.approx(PRIOR.sway, abs=0.003), "the left foot stands: the pelvis is to the left"
    assert middle[3 * quarter] == pytest.approx(PRIOR.sway, abs=0.003)


def test_at_rest_the_posture_is_left_alone(robot: Robot, stride: Stride) -> None:
    posture = np.tile(crouch(robot, 0.7, 0.0, 0.1), (5, 1))
    command = np.tile([0.5, 0.2, 0.4, *[0.0] * 8], (5, 1))
    kept = stride(posture, np.full(5, 0.1), command, np.linspace(0.0, 0.9, 5), np.zeros(5))
    np.testing.assert_array_equal(kept, posture)


def test_spread_feet_stand_and_walk_further_apart_and_stay_flat(robot: Robot, stride: Stride) -> None:
    wide = Stride(robot, PRIOR.model_copy(update={"spread": 0.04}))
    posture, still = crouch(robot, 0.7, 0.02, 0.0), np.zeros(1)
    standing = wide(posture[None], still, np.zeros((1, 11)), still, still)[0]
    for side, outward in enumerate((1.0, -1.0)):
        (before, _), (after, rotation) = sole(robot, posture, side, 0.0), sole(robot, standing, side, 0.0)
        assert after - before == pytest.approx([0.0, 0.04 * outward, 0.0], abs=0.004)
        assert rotation[2, 2] > 0.999
    _, narrow, _ = walk(robot, stride, posture, 0.0, COMMANDS["forward"])
    _, soles, _ = walk(robot, wide, posture, 0.0, COMMANDS["forward"])
    width = soles[:, 0, 1] - soles[:, 1, 1] - narrow[:, 0, 1] + narrow[:, 1, 1]
    assert width == pytest.approx(np.full(len(PHASES), 0.08), abs=0.008)


def test_the_mirrored_command_half_a_stride_later_gives_the_mirrored_stride(robot: Robot, stride: Stride) -> None:
    random, rows = np.random.default_rng(0), 64
    legs = stride.legs.converted(lambda values: np.full(2, values.mean()))
    even = copy(stride)
    even.legs = replace(legs, side=stride.legs.side[0] * np.array([1.0, -1.0]))
    posture = robot.default_position[robot.support] + 0.1 * random.normal(size=(rows, 15))
    command, phase = random.uniform(-0.4, 0.4, (rows, 11)), random.uniform(size=rows)
    pitch, ones = random.uniform(-0.2, 0.4, rows), np.ones(rows)
    mirror = support_mirror(robot)
    turned = observation_layout(robot, False).mirrors[0](command)
    ours = mirror(even(posture, pitch, command, phase, ones))
    mirrored = even(mirror(posture), pitch, turned, (phase + 0.5) % 1.0, ones)
    np.testing.assert_allclose(mirrored, ours, atol=1e-9)


def test_other_legs_are_refused(robot: Robot) -> None:
    legless = replace(robot, sole_bodies=("left_knee_link", "right_knee_link"))
    with pytest.raises(ValueError, match=r"left_knee_link turns about y, x, z, y; .*gait.enabled to false"):
        Stride(legless, PRIOR)
