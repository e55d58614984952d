"""Which trials an evaluation consists of: sweeps, heavy cases, seeds, and what is held fixed in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from iowbc.recipe.evaluation import Evaluation, HeavyCase, Segment, Sweep
from iowbc.recipe.simulation.holding import FREE
from iowbc.recipe.task.commands import Commands
from iowbc.task.commands.script import CommandScript, CommandSegment
from iowbc.task.episodes import Episode

UNDISTURBED = {"impulse_scale": 0.0, "push_scale": 0.0}
"""Factors on the impulses on the object and the pushes on the base."""


@dataclass(frozen=True)
class Trial:
    """One trial: where it stands in the tables, and the episode it plays."""

    suite: str
    """"lifting", "pushing", "heavy" or another name for a group of trials."""
    case: str
    """Name within the suite; that of the suite for a sweep."""
    mass: float
    """Object mass [kg]."""
    number: int
    """0, 1, ...: trials of the same number have the same seed at every mass and in every variant."""
    episode: Episode


def command_script(sequence: Sequence[Segment], commands: Commands) -> CommandScript:
    """A recipe's command sequence as the 11-D commands over time."""
    return CommandScript(
        tuple(
            CommandSegment(
                duration=segment.duration,
                ramp=segment.ramp,
                command=(
                    *segment.velocity,
                    commands.nominal_height if segment.height is None else segment.height,
                    segment.pitch,
                    *segment.wrists,
                ),
            )
            for segment in sequence
        )
    )


def trials_at(
    suite: str,
    scene: str,
    mass: float,
    script: CommandScript,
    *,
    count: int,
    seed: int,
    fixed: Mapping[str, float],
    case: str | None = None,
) -> list[Trial]:
    """`count` trials with one mass [kg], seeded `seed`, `seed` + 1, ...; what is not `fixed` is drawn.

    A mass of 0 is played in the scene without an object.
    """
    held = dict(fixed)
    if mass == 0:
        scene = FREE
    else:
        held["object_mass"] = mass
    return [
        Trial(
            suite=suite,
            case=case or suite,
            mass=mass,
            number=number,
            episode=Episode(scene=scene, seed=seed + number, duration=script.duration, fixed=held, script=script),
        )
        for number in range(count)
    ]


def held_fixed(evaluation: Evaluation, part: Sweep | HeavyCase) -> dict[str, float]:
    """The randomised quantities that a sweep or a case holds, by name."""
    held = {} if evaluation.disturbances else dict(UNDISTURBED)
    if part.rolling_resistance is not None:
        held["object_ground_friction"] = part.rolling_resistance
    if part.partner_share is not None:
        held["partner_share"] = part.partner_share
    return held | part.fixed


def sweep_trials(
    evaluation: Evaluation, commands: Commands, suite: str, sweep: Sweep, masses: Sequence[float]
) -> list[Trial]:
    """The trials of a sweep at the given masses [kg]."""
    script = command_script(sweep.sequence or evaluation.sequence, commands)
    held = held_fixed(evaluation, sweep)
    return [
        trial
        for mass in masses
        for trial in trials_at(
            suite, sweep.scene, mass, script, count=evaluation.trials, seed=evaluation.seed, fixed=held
        )
    ]


def heavy_trials(evaluation: Evaluation, commands: Commands) -> list[Trial]:
    """The trials of all heavy cases."""
    return [
        trial
        for case in evaluation.heavy
        for trial in trials_at(
            "heavy",
            case.scene,
            case.mass,
            command_script(case.sequence or evaluation.sequence, commands),
            count=evaluation.trials,
            seed=evaluation.seed,
            fixed=held_fixed(evaluation, case),
            case=case.name,
        )
    ]


def heavier_mass(sweep: Sweep, last: float) -> float | None:
    """The next mass past the end of a sweep [kg], or None where the recipe stops."""
    if sweep.beyond is None or last + sweep.beyond.step > sweep.beyond.limit:
        return None
    return last + sweep.beyond.step
