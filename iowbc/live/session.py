"""Episodes on a page: a policy that is driven by hand, with commands, pushes, and what happened in the last minute."""

import contextlib
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import nominal_command
from iowbc.errors import Damaged
from iowbc.evaluation.play import Source, open_policy, requested_episode
from iowbc.evaluation.play_request import PlayRequest
from iowbc.evaluation.trials.plan import DIRECTIONS
from iowbc.live.drag import Drag, Pushed, spring_pulls
from iowbc.live.drawing import VIEW, GameMarks
from iowbc.live.track import PAST, MomentRecorder, Track, recorded
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.robot.description import Robot
from iowbc.task.episodes import in_world

AN_HOUR = (Segment(duration=600.0),) * 6
"""Commands for the maximum length of an episode: one hour."""
PUSH_DURATION = 0.1
"""Length of a push [s]; as long as those of `eval.robustness.pushes`."""


class Played(ABC):
    """Episodes for a page, to be closed."""

    track: Track
    """Record of the current episode."""
    request: Any
    """The conditions of the episode, as `begin` takes them."""
    robot: Robot
    period: float
    """Time of a step [s]."""
    marks: GameMarks | None = None
    """Path, walls and handle of a game."""
    view = VIEW
    """Initial position and target of a camera [m]."""
    checkpoint = ""
    """Text about the checkpoint in use, if the policy is in training."""

    def begin(self, request: Any) -> None:
        """A new episode under other conditions."""
        self.close()
        self._open(request)

    @abstractmethod
    def _open(self, request: Any) -> None:
        """Sets up the simulation of an episode."""

    @abstractmethod
    def reset(self) -> None:
        """Restart the episode."""

    @abstractmethod
    def step(self) -> None:
        """One control period. After an episode's end, which `track.ending` names, nothing moves until a reset."""

    @abstractmethod
    def drag(self, drags: Sequence[Drag]) -> None:
        """Apply mouse drags until the next call."""

    @abstractmethod
    def close(self) -> None:
        """Ends the simulation."""

    def refresh(self) -> None:  # noqa: B027 (a game has no checkpoint)
        """Reload the policy if it is a checkpoint that was rewritten."""


class Session(Played):
    """One episode after another in the world of a source."""

    def __init__(self, source: Source, request: PlayRequest) -> None:
        """Begins an episode. Raises ContractBroken for a damaged export, Damaged for a damaged checkpoint."""
        self.source = source
        self.wanted = nominal_command(source.world.recipe.task.commands)
        """The command to approach, (11,); it may be changed in place."""
        self.pull = spring_pulls(())
        """Steady forces, world frame, (3,) each [N]."""
        self._open(request)

    def _open(self, request: PlayRequest) -> None:
        self.request = replace(request, sequence=AN_HOUR)
        self.environment = self.source.environment(requested_episode(self.source.world.recipe, self.request))
        self.environment.batch.guidance.commander.steer(self.wanted)
        self.robot, self.period = self.environment.batch.robot, self.environment.period
        if not self.checkpoint:  # `refresh` loads later ones, and its file is removed when the training ends
            self._load()
        self._recorder = MomentRecorder(self.environment.batch, recorded(self.environment))
        self.reset()

    def _load(self) -> None:
        self.written = self.source.policy.stat().st_mtime
        """Modification time of the policy file; a checkpoint is rewritten during training."""
        if self.source.key:
            self.checkpoint = time.strftime("checkpoint of %H:%M:%S", time.localtime(self.written))
        self._policy = open_policy(self.source, self.environment)

    def reset(self) -> None:
        self._observation = self.environment.reset()
        self._policy.reset(np.ones(1, np.bool_))
        self._steps = 0
        self._pushes = {"robot": (np.zeros(3), 0), "object": (np.zeros(3), 0)}
        title = f"{self.request.scene}, {self.request.object_mass:g} kg"
        self.track = Track(self._recorder, self.source.world, title, round(PAST / self.period))
        self.track.moments.append(self._recorder.look(0.0))

    def refresh(self) -> None:
        policy = self.source.policy
        with contextlib.suppress(FileNotFoundError, Damaged):  # the training has ended meanwhile
            if policy.is_file() and policy.stat().st_mtime > self.written:
                self._load()

    def step(self) -> None:
        if self.track.ending:
            return
        environment, layout = self.environment, self.environment.layout
        simulation = environment.batch.simulation
        simulation.planned_push[0] = self._force("robot")
        simulation.planned_impulse[0] = self._force("object") if simulation.state.has_object[0] else 0.0
        seen = self._observation
        action = self._policy.act(seen[:, layout.observation], seen[:, layout.privileged])
        self._observation, _, done, infos = environment.step(action)
        self._steps += 1
        if done[0]:
            self.track.ending = str(infos[0]["end"])
            self._policy.reset(done)
        else:
            self.track.moments.append(self._recorder.look(self._steps * self.period))

    def push(self, what: Pushed, direction: str, impulse: float) -> None:
        """Push for `PUSH_DURATION`; `direction`: of `DIRECTIONS`, from the commanded heading; `impulse` [N·s]."""
        forward, left = np.array(DIRECTIONS[direction])[:, None]
        along = in_world(forward, left, self.environment.batch.memory.heading_reference[:1])[0]
        steps = max(1, round(PUSH_DURATION / self.period))
        self._pushes[what] = (impulse / (steps * self.period) * along, steps)

    def drag(self, drags: Sequence[Drag]) -> None:
        """Apply the bounded spring forces of mouse drags; bodies without a drag are released."""
        self.pull = spring_pulls(drags)

    def _force(self, what: Pushed) -> Array:
        force, left = self._pushes[what]
        self._pushes[what] = (force, max(0, left - 1))
        return self.pull[what] + (force if left else 0.0)

    def close(self) -> None:
        self.environment.close()
