"""Left and right: the mirror maps against the physics."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from task_worlds import QUIET, actions

from iowbc.control.action import action_mirror
from iowbc.control.command import command_mirror
from iowbc.robot.description import Robot
from iowbc.sim import world
from iowbc.task.episodes import CommandScript, CommandSegment, Episode
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]

COMMANDS = (
    (0.3, 0.1, 0.2, 0.72, 0.1, 0.02, 0.01, 0.03, -0.01, 0.02, 0.0),
    (0.2, -0.2, -0.3, 0.70, 0.2, 0.0, 0.02, 0.0, 0.01, 0.0, 0.04),
)
STEPS = 35


def scripts(scene: str, robot: Robot) -> tuple[Episode, Episode]:
    """An episode with commands, and the one with the mirrored commands."""
    mirror = command_mirror(robot)
    both = []
    for turn in (lambda c: c, lambda c: mirror(np.array(c))):
        segments = tuple(CommandSegment(0.4, tuple(turn(command)), 0.2) for command in COMMANDS)
        both.append(Episode(scene, seed=0, duration=5.0, script=CommandScript(segments)))
    return both[0], both[1]


def even_out(model: Any) -> None:
    """Makes a model exactly symmetric: the real robot's masses differ between the sides by parts in a thousand."""
    turn = np.diag([1.0, -1.0, 1.0])
    names = [model.body(index).name for index in range(model.nbody)]
    tensors = []
    for index in range(model.nbody):
        axes = np.zeros(9)
        mujoco.mju_quat2Mat(axes, model.body_iquat[index])
        axes = axes.reshape(3, 3)
        tensors.append(axes @ np.diag(model.body_inertia[index]) @ axes.T)
    for index, name in enumerate(names):
        other = names.index(name.replace("right_", "left_"))
        mirrored = turn @ tensors[other] @ turn
        if other == index:
            tensor = 0.5 * (tensors[index] + mirrored) if not name.startswith("left_") else tensors[index]
            model.body_ipos[index, 1] *= name.startswith("left_")
        else:
            tensor, model.body_mass[index] = mirrored, model.body_mass[other]
            model.body_ipos[index] = turn @ model.body_ipos[other]
        inertia, axes = np.linalg.eigh(tensor)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        model.body_inertia[index] = inertia
        mujoco.mju_mat2Quat(model.body_iquat[index], axes.ravel())
    mujoco.mj_setConst(model, mujoco.MjData(model))


@pytest.mark.parametrize("observe_object", [True, False])
def test_mirroring_twice_changes_nothing(make: Make, robot: Robot, observe_object: bool) -> None:
    env = make(changes={"task.observation.observe_object": observe_object})
    rows = env.reset()
    for layout, values in ((env.layout, rows), (env.layout.state, rows[:, env.layout.observation])):
        mirror = layout.mirror
        assert np.array_equal(mirror(mirror(values)), values)
        assert not np.array_equal(mirror(values), values)
        assert mirror(values).dtype == np.float32
    given = actions(0, 4)
    assert np.array_equal(action_mirror(robot)(action_mirror(robot)(given)), given)


@pytest.mark.parametrize("scene", ["free", "lift", "push"])
def test_the_mirrored_course_is_the_course_of_the_mirrored_start(
    make: Make, robot: Robot, scene: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = world.compile_scene

    def even(*arguments: Any) -> Any:
        model = compiled(*arguments)
        even_out(model)
        return model

    monkeypatch.setattr(world, "compile_scene", even)
    env = make(num_envs=2, changes=QUIET, episodes=scripts(scene, robot))
    rows, mirror, mirror_action = env.reset(), env.layout.mirror, action_mirror(robot)
    env.batch.memory.phase[1] = 0.5
    rewards: list[Any] = []
    for step in range(STEPS):
        assert rows[1] == pytest.approx(mirror(rows[0]), abs=2e-3, rel=2e-3), f"step {step}"
        given = actions(step, 1, 0.3)
        rows, reward, done, _ = env.step(np.concatenate([given, mirror_action(given)]))
        assert not done.any()
        rewards.append(reward)
    assert env.signals["phase"][0, 0] != 0.0, "the gait clock should run"
    ours, mirrored = np.array(rewards).T
    assert mirrored == pytest.approx(ours, abs=1e-4)
