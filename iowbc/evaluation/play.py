"""Playback of one episode, in MuJoCo's viewer in real time or as a video file."""

import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from iowbc.control.action import action_mirror
from iowbc.deploy import contract, exported_folder
from iowbc.errors import Interrupted, NoDisplay, require_known
from iowbc.evaluation.exported import ExportedPolicy, exported_world
from iowbc.evaluation.films import film_episode, written_film
from iowbc.evaluation.play_request import PlayRequest
from iowbc.evaluation.trials.plan import command_script, held_fixed, planned_episode, sequence_for
from iowbc.evaluation.trials.protocol import evaluated_world
from iowbc.evaluation.trials.rollout import Outcome, play_in
from iowbc.learning.acting import Policy, load_policy, unfinished_policy
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import load_robot
from iowbc.sim.rendering.appearance import Appearance
from iowbc.sim.rendering.renderer import Line, add_lines
from iowbc.sim.simulation import Simulation
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv


@dataclass(frozen=True)
class Source:
    """A policy to play and the specification of its recipe."""

    world: Specification
    policy: Path
    """Artifact of `teacher` or `distill`, an exported folder, or the checkpoint of a teacher that is being trained."""
    key: str = ""
    """Stage key to which the checkpoint is bound."""

    @property
    def exported(self) -> bool:
        return (self.policy / exported_folder.CONTRACT).is_file()

    def environment(self, episode: Episode) -> VectorEnv:
        """One in-process environment for an episode. Raises ContractBroken if an exported folder is damaged."""
        with contract.readable(self.policy) if self.exported else nullcontext():
            return VectorEnv(self.world, num_envs=1, workers=0, seed=0, episodes=(episode,))


def with_evaluation(source: Source, evaluation: Evaluation) -> Source:
    """The source with the settings of another evaluation. An exported controller keeps the scenes of its contract."""
    asked = source.world.recipe.model_copy(update={"eval": evaluation})
    world = replace(source.world, recipe=asked)
    return replace(source, world=world if source.exported else evaluated_world(world))


def exported_source(folder: Path) -> Source:
    """The source in an exported folder, which is self-contained. Raises ContractBroken."""
    return Source(exported_world(folder), folder)


def play(
    source: Source,
    request: PlayRequest,
    progress: Callable[[float, float], None] = lambda seconds, duration: None,
) -> tuple[Episode, Outcome, int]:
    """Play one episode in the viewer or, with `request.video`, to that mp4 file (no display needed): the episode, its
    outcome and the number of video frames, 0 in the viewer. `progress` receives the rendered and the total duration of
    a video [s]. Raises NoDisplay, ContractBroken for a damaged export, Interrupted when the viewer is closed."""
    recipe = source.world.recipe
    episode = requested_episode(recipe, request)
    if request.video is None:
        require_display()
    with closing(source.environment(episode)) as environment:
        policy = open_policy(source, environment)
        if request.video is None:
            with in_window(environment.batch.simulation) as look:
                return episode, play_in(environment, policy, look=look)[0], 0
        settings = recipe.eval.video.model_copy(update={"duration": episode.duration})
        title = f"{recipe.name}: {episode.scene}, {request.object_mass:g} kg, seed {request.seed}"
        with written_film(request.video, settings.fps) as add:
            filmed = (environment, policy, add, settings, title)
            return episode, *film_episode(*filmed, progress=lambda seconds: progress(seconds, episode.duration))


def requested_episode(recipe: Recipe, request: PlayRequest) -> Episode:
    """The episode of a request. Raises UsageError if the recipe lacks the scene."""
    require_known(request.scene, "scene", recipe.simulation.scenes.names)
    script = command_script(sequence_for(recipe, request.scene, request.sequence), recipe.task.commands)
    fixed = held_fixed(request.partner_share, disturbed=request.disturbances)
    return planned_episode(request.scene, script, request.object_mass, request.seed, fixed)


def open_policy(source: Source, environment: VectorEnv) -> Policy:
    """The policy of a source: an exported controller where there is a contract, else a network."""
    if source.exported:
        return ExportedPolicy(source.policy, environment)
    if source.policy.is_dir():
        return load_policy(source.policy, environment.layout.describe())
    mirrors = (environment.layout.mirror, action_mirror(load_robot(source.world.robot)))
    return unfinished_policy(source.policy, source.key, source.world.recipe.teacher, mirrors)


def require_display() -> None:
    """Raises NoDisplay where the viewer cannot open a window."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NoDisplay(
            "no display (DISPLAY and WAYLAND_DISPLAY are unset): give --video out.mp4 to make a film instead"
        )


@contextmanager
def in_window(simulation: Simulation, lines: Sequence[Line] = ()) -> Iterator[Callable[[float], None]]:
    """A window that shows the first environment of a simulation, with lines on the ground. Yields a function that shows
    the present state and waits until a time [s] since the start; it raises Interrupted when the window is closed."""
    import mujoco.viewer  # needs a window system as soon as it is imported

    appearance = Appearance(simulation, 0)
    data = appearance.data
    with mujoco.viewer.launch_passive(appearance.model, data, show_left_ui=False, show_right_ui=False) as viewer:
        with viewer.lock():
            add_lines(viewer.user_scn, lines)
        start = time.monotonic()

        def look(seconds: float) -> None:
            if not viewer.is_running():
                raise Interrupted("the viewer was closed")
            with viewer.lock():
                appearance.update()
                viewer.cam.lookat[:] = data.qpos[:3]
            viewer.sync()
            time.sleep(max(0.0, start + seconds - time.monotonic()))

        yield look
