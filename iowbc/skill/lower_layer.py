"""The lower layer of the game: environments with the frozen student at the control frequency."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.control.command import nominal_command
from iowbc.robot.description import load_robot
from iowbc.rollouts.blocks import in_blocks
from iowbc.rollouts.policies import History, HistoryPolicy
from iowbc.task.batch import Batch
from iowbc.task.episodes import Episode
from iowbc.task.judge import Judgement
from iowbc.task.layout import full_layout
from iowbc.task.motion import Motion
from iowbc.task.specification import Specification
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.shared import private_buffers


@dataclass(frozen=True)
class Student:
    """Student policy and its history length."""

    policy: HistoryPolicy
    history: int
    """Number of observations in H_t."""
    observation: int
    """Size of the part of s_t that the student observes."""


def load_student(folder: Path, world: Specification | None = None) -> Student:
    """The student in the artifact of `distill`. Raises StageFailed for another kind of policy, and for one that was
    trained on other observations than those of the `world` in which it acts."""
    from iowbc.learning.as_numpy import student_policy
    from iowbc.learning.storage import load_student_network, require_layout

    network, about = load_student_network(folder)
    if world is not None:
        require_layout(folder, about, full_layout(world.recipe, load_robot(world.robot)).describe())
    return Student(student_policy(network), network.history, network.observation)


class LowerLayer(Batch):
    """n environments controlled by a student. Commands, partners and starts of episodes are set by the caller."""

    def __init__(self, specification: Specification, student: Student, episodes: Sequence[Episode], block: int) -> None:
        """`block`: see `iowbc.rollouts.blocks`."""
        recipe = specification.recipe
        partner = recipe.simulation.partner.model_copy(update={"strongest": recipe.skill.human.strongest})
        simulation = recipe.simulation.model_copy(update={"partner": partner})
        world = replace(specification, recipe=recipe.model_copy(update={"simulation": simulation}))
        setup = Setup(world, len(episodes), 0, tuple(episodes))
        super().__init__(setup, 0, setup.count, private_buffers(setup.buffer_fields(), setup.count))
        self.wanted = np.tile(nominal_command(recipe.task.commands), (self.n, 1))
        """Commands that the robots approach, (n, 11)."""
        self.guidance.commander.steer(self.wanted)
        self.simulation.partner.steered[:] = True
        self.moved: Motion
        """The motion after the last control step."""
        self.happened = np.zeros((3, self.n), np.bool_)
        """Falls, drops and divergence since the episode began, (3, n)."""
        self.human = np.zeros((self.n, 4))
        """Intentions of humans, start frame, (n, 4): handle's velocity [m/s], object's yaw rate [rad/s], height [m]."""
        self._student, self._block = student.policy, block
        self._history = History(self.n, student.history, student.observation)
        self._starts = np.ones(self.n, np.bool_)

    def start(self, which: Indices) -> None:
        """Starts new episodes in some environments, (k,)."""
        self.moved = self.begin(which)
        self._observe(self.moved, which)
        self._starts[which] = True
        self.happened[:, which] = False

    def control(self) -> None:
        rows = self.buffers["observation"][:, : self._history.frames.shape[2]]
        seen = self._history.push(rows, self._starts)
        self.buffers["action"][:] = in_blocks(self._student, self._block, seen)
        self._starts[:] = False
        self.step()

    def record(self, judgement: Judgement, action: Array) -> None:
        """Records nothing: the game does not use trial signals."""

    def feed_partner(self, feed: Array) -> None:
        feed[:] = self.human

    def finish(self, judgement: Judgement) -> None:
        """Records falls, drops and divergence; the game decides when episodes end."""
        self.moved, ending = judgement.motion, judgement.ending
        self.happened |= np.stack([ending.fallen, ending.dropped, ending.diverged])
        self._observe(self.moved)
