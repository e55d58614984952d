"""Planned trials of an evaluation: sweeps, cases, seeds and fixed quantities."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from iowbc.evaluation.trials.scripts import drawn_script
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.evaluation.sequences import LIFTING, PUSHING, Segment
from iowbc.recipe.evaluation.suites import EIGHT, Case, MassSweep
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.task.commands import Commands
from iowbc.task.episodes import CommandScript, CommandSegment, Episode, PlannedPull, PlannedPush

SPLITS = {"development": 0, "test": 2**33}
"""Seed offset of each split. All seeds of recipes are smaller, so that the splits never overlap."""
UNDISTURBED = {"impulse_scale": 0.0, "push_scale": 0.0}
"""Factors on the impulses on the object and the pushes on the base."""
DIRECTIONS: dict[str, tuple[float, float]] = {
    name: (math.cos(place * math.pi / 4), math.sin(place * math.pi / 4)) for place, name in enumerate(EIGHT)
}
"""Directions of pushes on the base, heading frame: from forward counterclockwise in steps of 45°."""
AXES = {"x": (1.0, 0.0), "y": (0.0, 1.0)}
"""Directions of pulls on the object, heading frame."""


@dataclass(frozen=True)
class Trial:
    """One trial: its place in the tables and its episode."""

    kind: str
    """A sweep such as "lifting", or "heavy", "stagnation", "robustness", "pushes", "compliance", "impedance", "map"."""
    suite: str
    """Name of its table: kind, partner and, for sweeps without the evaluation's disturbances, "undisturbed"."""
    case: str
    """Sweeps: name of the suite, or "no object"; compliance: the partner's behaviour or the blocked crate; impedance:
    such as "x 0.5 Hz"; map: such as "μ 0.06"; pushes: direction, with ", walking" if the robot walks."""
    mass: float
    """Object mass [kg]; 0 without one."""
    number: int
    """0, 1, ...: trials of the same number have the same seed and drawn script at every mass and in every variant."""
    episode: Episode
    impulse: float = 0.0
    """Impulse on the base [N·s]; 0 without a push."""


def command_script(sequence: Sequence[Segment], commands: Commands) -> CommandScript:
    """A recipe's command sequence as the 11-D commands over time."""

    def at_end(segment: Segment) -> tuple[float, ...]:
        height = commands.nominal_height if segment.height is None else segment.height
        return (*segment.velocity, height, segment.pitch, *segment.wrists)

    return CommandScript(tuple(CommandSegment(one.duration, at_end(one), one.ramp) for one in sequence))


def sequence_for(recipe: Recipe, scene: str, own: Sequence[Segment] = ()) -> tuple[Segment, ...]:
    """Fixed commands in a scene: `own` of a sweep or case, else the recipe's, else defaults of lifting or pushing."""
    return tuple(own) or recipe.eval.sequence or (PUSHING if _pushed(recipe, scene) else LIFTING)


def script_for(
    recipe: Recipe, scene: str, seed: int, own: Sequence[Segment] = (), repetitions: int = 1
) -> CommandScript:
    """Commands of a trial: fixed if a sequence is given or the recipe has no random scripts, else drawn from `seed`."""
    scripts, commands = recipe.eval.scripts, recipe.task.commands
    if own or recipe.eval.sequence or scripts is None:
        return command_script(sequence_for(recipe, scene, own) * repetitions, commands)
    pushing = _pushed(recipe, scene)
    parts = (drawn_script(scripts, commands, pushing=pushing, seed=seed, part=part) for part in range(repetitions))
    return CommandScript(tuple(segment for part in parts for segment in part.segments))


def _pushed(recipe: Recipe, scene: str) -> bool:
    return bool(getattr(recipe.simulation.scenes, scene).kind == "push")


def trial_seed(evaluation: Evaluation, number: int) -> int:
    return SPLITS[evaluation.split] + evaluation.seed + number


def planned_episode(
    scene: str,
    script: CommandScript,
    mass: float,
    seed: int,
    fixed: Mapping[str, float],
    push: PlannedPush | None = None,
    pull: PlannedPull | None = None,
) -> Episode:
    """Episode of a trial with an object of a mass [kg], 0: the scene without one; `fixed`: fixed quantities by name.
    All others are random."""
    held = dict(fixed) if mass == 0 else {**fixed, "object_mass": mass}
    return Episode(FREE if mass == 0 else scene, seed, script.duration, held, script, push, pull)


def _cell(
    recipe: Recipe,
    place: tuple[str, str, str],
    scene: str,
    mass: float,
    fixed: Mapping[str, float],
    sequence: Sequence[Segment] = (),
    *,
    repetitions: int = 1,
    trials: int | None = None,
    push: PlannedPush | None = None,
    pull: PlannedPull | None = None,
    impulse: float = 0.0,
) -> Iterator[Trial]:
    """Trials of one table cell, which differ only in seed.

    place: kind, suite and case; mass: of the object [kg]; fixed, push, pull: see `planned_episode`; sequence: own
    commands, see `script_for`; trials: number of trials, default `eval.trials`; impulse: of the push [N·s].
    """
    for number in range(trials or recipe.eval.trials):
        seed = trial_seed(recipe.eval, number)
        script = script_for(recipe, scene, seed, sequence, repetitions)
        episode = planned_episode(scene, script, mass, seed, fixed, push, pull)
        yield Trial(*place, mass, number, episode, impulse)


def held_fixed(
    partner_share: float | None, rolling_resistance: float | None = None, *, disturbed: bool
) -> dict[str, float]:
    """Randomised quantities with fixed values, by name; None leaves a quantity random."""
    held = {"object_ground_friction": rolling_resistance, "partner_share": partner_share}
    calm = {} if disturbed else UNDISTURBED
    return calm | {name: value for name, value in held.items() if value is not None}


@dataclass(frozen=True)
class PlannedSweep:
    """A mass sweep at one share of the partner."""

    recipe: Recipe
    kind: str
    sweep: MassSweep
    """The sweep at that share (`Sweep.at`)."""
    disturbed: bool
    """True if random impulses and pushes are enabled."""
    no_object: bool = False
    """True if the sweep includes the row without an object."""

    @property
    def partner_share(self) -> float | None:
        """Share of the partner; None: random."""
        return self.sweep.partner_shares[0]

    @property
    def suite(self) -> str:
        """Name of its table."""
        share = self.partner_share
        partner = "" if share == 0 else " with drawn partner" if share is None else f" with partner {share:g}"
        calm = self.recipe.eval.disturbances and not self.disturbed
        return f"{self.kind}{partner}{' undisturbed' if calm else ''}"

    @property
    def masses(self) -> tuple[float, ...]:
        """Masses of the recipe [kg], raised to the object's smallest mass."""
        thing = getattr(self.recipe.simulation.scenes, self.sweep.scene).object
        return tuple(dict.fromkeys(max(mass, thing.smallest_mass) for mass in self.sweep.masses))

    def named(self) -> list[Trial]:
        """The trials that the recipe names: those without an object, and those at each mass."""
        return (self.trials((0.0,), "no object") if self.no_object else []) + self.trials(self.masses)

    def trials(self, masses: Iterable[float], case: str | None = None) -> list[Trial]:
        """The trials at given masses [kg]; `case`: default the name of the suite."""
        place, own = (self.kind, self.suite, case or self.suite), self.sweep
        fixed = held_fixed(self.partner_share, own.rolling_resistance, disturbed=self.disturbed) | own.fixed
        return [trial for mass in masses for trial in _cell(self.recipe, place, own.scene, mass, fixed, own.sequence)]

    def heavier(self, last: float) -> float | None:
        """Next mass beyond the end of the sweep [kg], or None at the recipe's limit."""
        beyond = self.sweep.beyond
        return None if beyond is None or last + beyond.step > beyond.limit else last + beyond.step


def planned_sweeps(recipe: Recipe) -> list[PlannedSweep]:
    """Sweeps of each kind at every share of the partner, then those without disturbances."""
    evaluation, planned = recipe.eval, []
    for kind, sweep in evaluation.sweeps.items():
        alone = 0.0 if 0.0 in sweep.partner_shares else sweep.partner_shares[0]
        for share in sweep.partner_shares:
            no_object = sweep.no_object and share == alone
            planned.append(PlannedSweep(recipe, kind, sweep.at(share), evaluation.disturbances, no_object))
        if evaluation.disturbances and sweep.undisturbed:
            calm = {"masses": sweep.undisturbed, "beyond": None}
            planned += [
                PlannedSweep(recipe, kind, sweep.at(share).model_copy(update=calm), disturbed=False)
                for share in sweep.partner_shares
            ]
    return planned


def _case(recipe: Recipe, kind: str, case: Case, disturbed: bool, trials: int | None = None) -> Iterator[Trial]:
    fixed = held_fixed(case.partner_share, case.rolling_resistance, disturbed=disturbed) | case.fixed
    cell = (recipe, (kind, kind, case.name), case.scene, case.mass, fixed, case.sequence)
    return _cell(*cell, repetitions=case.repetitions, trials=trials)


def case_trials(recipe: Recipe) -> Iterator[Trial]:
    """The trials of all single cases: heavy, stagnation, robustness."""
    asked = recipe.eval
    suites = {"stagnation": asked.stagnation, "robustness": asked.robustness}
    cases = {"heavy": asked.heavy, **{kind: suite.cases for kind, suite in suites.items() if suite is not None}}
    for kind, own in cases.items():
        for case in own:
            yield from _case(recipe, kind, case, asked.disturbances)


def push_trials(recipe: Recipe) -> Iterator[Trial]:
    """Trials with a push on the base, standing and walking, at every impulse in every direction."""
    robustness, fixed = recipe.eval.robustness, UNDISTURBED | {"partner_share": 0.0}
    ladders = {} if robustness is None else {"": robustness.pushes, ", walking": robustness.walking_pushes}
    for words, ladder in ladders.items():
        if ladder is None:
            continue
        for direction, impulse in itertools.product(ladder.directions, ladder.impulses):
            forward, left = DIRECTIONS[direction]
            push = PlannedPush(ladder.time, ladder.duration, (impulse * forward, impulse * left))
            cell = (recipe, ("pushes", "pushes", f"{direction}{words}"), ladder.scene, ladder.mass, fixed)
            yield from _cell(*cell, ladder.sequence, trials=ladder.trials, push=push, impulse=impulse)


def compliance_trials(recipe: Recipe) -> Iterator[Trial]:
    """Trials with every partner behaviour, then with a blocked crate, then with sinusoidal pulls."""
    asked = recipe.eval.compliance
    if asked is None:
        return
    for share, mass, behaviour in itertools.product(asked.partner_shares, asked.masses, asked.behaviours):
        fixed = UNDISTURBED | {"partner_behaviour": float(BEHAVIOURS.index(behaviour)), "partner_share": share}
        suite = "compliance" if len(asked.partner_shares) == 1 else f"compliance with partner {share:g}"
        cell = (recipe, ("compliance", suite, behaviour), asked.scene, mass, fixed)
        yield from _cell(*cell, asked.sequence, trials=asked.trials)
    if asked.blocked is not None:
        yield from _case(recipe, "compliance", asked.blocked, False, asked.trials)
    pulls = asked.impedance
    if pulls is None:
        return
    fixed = UNDISTURBED | {"partner_share": 0.0}
    for axis, frequency in itertools.product(pulls.directions, pulls.frequencies):
        duration = max(pulls.cycles, math.ceil(pulls.shortest * frequency)) / frequency
        force = (pulls.amplitude * AXES[axis][0], pulls.amplitude * AXES[axis][1])
        place = ("impedance", "impedance", f"{axis} {frequency:g} Hz")
        sequence = (Segment(duration=pulls.begin + duration, ramp=0.0), *pulls.walk)
        pull = PlannedPull(pulls.begin, duration, frequency, force)
        yield from _cell(recipe, place, pulls.scene, pulls.mass, fixed, sequence, trials=asked.trials, pull=pull)


def map_trials(recipe: Recipe) -> Iterator[Trial]:
    """Trials of pushing at every rolling resistance and mass."""
    asked = recipe.eval.map
    if asked is None:
        return
    for resistance, mass in itertools.product(asked.rolling_resistances, asked.masses):
        fixed = held_fixed(asked.partner_share, resistance, disturbed=recipe.eval.disturbances)
        place = ("map", "map", f"μ {resistance:g}")
        yield from _cell(recipe, place, asked.scene, mass, fixed, asked.sequence, trials=asked.trials)
