"""Plays a policy for the eye: in MuJoCo's viewer where there is a display, or into a film."""

import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import ValidationError

from iowbc.deploy import contract
from iowbc.deploy.controller import Controller
from iowbc.errors import ContractBroken, Interrupted, NoDisplay, UsageError, require_known
from iowbc.evaluation.exported import ExportedPolicy
from iowbc.evaluation.film import EpisodeFilm
from iowbc.evaluation.trials.plan import UNDISTURBED, command_script, trials_at
from iowbc.evaluation.trials.protocol import ending, in_batch, replayed
from iowbc.evaluation.trials.rollout import Acting, Played, play_in
from iowbc.learning.acting import load_policy
from iowbc.recipe.evaluation import Segment, Video
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE, SCENES
from iowbc.sim.rendering.appearance import Appearance
from iowbc.task.episodes import Episode
from iowbc.task.vector.vector_env import VectorEnv


@dataclass(frozen=True)
class Source:
    """What is played: a policy, and the world that its recipe describes."""

    recipe: Recipe
    robot: Path
    """The robot's folder."""
    rg: Path | None
    """Artifact of `rg-fit`, or the generator in an exported folder; None without a reference generator."""
    policy: Path
    """Artifact of `teacher` or `distill`, or an exported folder."""


def exported_source(folder: Path) -> Source:
    """The source in an exported folder, which holds all it needs. Raises ContractBroken."""
    contract.read_contract(folder)
    path = folder / contract.RECIPE
    try:
        recipe = Recipe.model_validate_json(path.read_bytes())
    except (FileNotFoundError, ValidationError) as error:
        raise ContractBroken(f"{path}: missing or not a recipe of this version: {error}; export again") from error
    generator = folder / contract.GENERATOR
    return Source(recipe, folder / contract.ROBOT, generator if generator.is_dir() else None, folder)


def play(
    source: Source,
    *,
    scene: str = "lift",
    mass: float = 4.0,
    partner_share: float | None = 0.0,
    sequence: Sequence[Segment] = (),
    seed: int = 0,
    disturbances: bool = False,
    video: Path | None = None,
    video_settings: Video | None = None,
    interrupted: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Play one episode; in the viewer, or with `video` into that mp4 file (no display needed).

    mass: of the object [kg]; 0 plays without one, as the scene `free` does. partner_share: None draws it.
    sequence: the commands, by default those of the recipe's `eval.sequence`, for an exported folder those of its
    acceptance. video_settings: by default `eval.video`, without its limit of length.
    Returns how it ended: `end` ("finished", "fell", ...), `seconds`, `duration`, and with a film its `frames`.
    Raises UsageError for an unknown scene or a film that is no mp4, NoDisplay, ContractBroken for a damaged export,
    Interrupted when interrupted or when the viewer was closed.
    """
    recipe = source.recipe
    require_known(scene, "scene", SCENES)
    mass = 0.0 if scene == FREE else mass
    if video is not None and video.suffix != ".mp4":
        raise UsageError(f"{video}: a film is an mp4 file; give a name that ends in .mp4")
    script = command_script(sequence or recipe.eval.sequence, recipe.task.commands)
    fixed = {} if disturbances else dict(UNDISTURBED)
    if partner_share is not None:
        fixed["partner_share"] = partner_share
    episode = trials_at("play", scene, mass, script, count=1, seed=seed, fixed=fixed)[0].episode
    if video is None:
        require_display()
    environment = _environment(source, episode)
    try:
        policy = open_policy(source.policy, environment)
        if video is None:
            played, frames = _play_in_viewer(environment, recipe, policy, interrupted), 0
        else:
            settings = video_settings or recipe.eval.video.model_copy(update={"duration": episode.duration})
            title = [f"{recipe.name}: {episode.scene}, {mass:g} kg, seed {seed}"]
            with EpisodeFilm(environment, video, settings, title) as film:
                played = play_in(environment, recipe, policy, interrupted, look=film.look)[0]
            frames = film.frames
    finally:
        environment.close()
    return {"end": ending(played), "seconds": played.seconds, "duration": episode.duration, "frames": frames}


def film_row(
    recipe: Recipe,
    robot: Path,
    rg: Path | None,
    policy: Acting,
    row: "pd.Series[Any]",
    path: Path,
    interrupted: Callable[[], bool] = lambda: False,
) -> Played:
    """Play the trial in a row of `trials.parquet` again and film it. Raises Interrupted when interrupted."""
    environment = _environment(Source(recipe, robot, rg, path), replayed(row))
    title = [f"{row['variant']}: {row['case']}, {row['mass']:g} kg, trial {row['trial']}"]
    try:
        with EpisodeFilm(environment, path, recipe.eval.video, title) as film:
            return play_in(environment, recipe, in_batch(policy, row), interrupted, look=film.look)[0]
    finally:
        environment.close()


def open_policy(folder: Path, environment: VectorEnv) -> Acting:
    """The policy in a folder: an exported controller where there is a contract, else a trained network."""
    if (folder / contract.CONTRACT).is_file():
        return ExportedPolicy(Controller.load(folder, robots=environment.num_envs), environment)
    return load_policy(folder)


def require_display() -> None:
    """Raises NoDisplay where the viewer cannot open a window."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NoDisplay(
            "no display (DISPLAY and WAYLAND_DISPLAY are unset): give --video out.mp4 to make a film instead"
        )


def _environment(source: Source, episode: Episode) -> VectorEnv:
    return VectorEnv(source.recipe, source.robot, rg=source.rg, num_envs=1, workers=0, seed=0, episodes=(episode,))


def _play_in_viewer(environment: VectorEnv, recipe: Recipe, policy: Acting, interrupted: Callable[[], bool]) -> Played:
    """One episode in real time in a window. Raises Interrupted when the window is closed."""
    import mujoco.viewer  # needs a window system as soon as it is imported

    appearance = Appearance(environment.batch.simulation, 0)
    data = appearance.data
    with mujoco.viewer.launch_passive(appearance.model, data, show_left_ui=False, show_right_ui=False) as viewer:
        start = time.monotonic()

        def look(seconds: float) -> None:
            if not viewer.is_running():
                raise Interrupted("the viewer was closed")
            with viewer.lock():
                appearance.update()
                viewer.cam.lookat[:] = data.qpos[:3]
            viewer.sync()
            time.sleep(max(0.0, start + seconds - time.monotonic()))

        return play_in(environment, recipe, policy, interrupted, look=look)[0]
