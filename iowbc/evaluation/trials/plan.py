"""Which trials an evaluation consists of: sweeps, cases, seeds, and what is held fixed in each."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from iowbc.evaluation.trials.scripts import drawn_script
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.evaluation.sequences import LIFTING, PUSHING
from iowbc.recipe.evaluation.suites import EIGHT, Case, Impedance, MassSweep, PushLadder
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.task.commands import Commands
from iowbc.task.commands.script import CommandScript, CommandSegment
from iowbc.task.episodes import Episode, PlannedPull, PlannedPush

NO_OBJECT = "no object"
"""Case of a sweep in the scene without an object."""
SPLITS = {"development": 0, "test": 2**33}
"""What is added to the seeds of each split: no seed of a recipe is as great, so that the two never meet."""
UNDISTURBED = {"impulse_scale": 0.0, "push_scale": 0.0}
"""Factors on the impulses on the object and the pushes on the base."""
DIRECTIONS: dict[str, tuple[float, float]] = {
    name: (math.cos(place * math.pi / 4), math.sin(place * math.pi / 4)) for place, name in enumerate(EIGHT)
}
"""Of pushes on the base, heading frame: forward, and on to the left by an eighth of a turn each."""
AXES = {"x": (1.0, 0.0), "y": (0.0, 1.0)}
"""Of pulls on the object, heading frame."""


@dataclass(frozen=True)
class Trial:
    """One trial: where it stands in the tables, and the episode it plays."""

    kind: str
    """"lifting", "pushing", "squeezing", "heavy", "stagnation", "robustness", "pushes", "compliance", "impedance",
    "map", or another word for what is asked."""
    suite: str
    """The table it belongs to: the kind, with what partner, and whether undisturbed beside disturbed ones."""
    case: str
    """Name within the suite. Of a sweep that of the suite, or "no object"; of compliance the partner's behaviour or
    that of the blocked crate; of impedance like "x 0.5 Hz"; of a map like "μ 0.06"; of pushes the direction, with
    ", walking" where the robot walks."""
    mass: float
    """Object mass [kg]; 0 without one."""
    number: int
    """0, 1, ...: trials of the same number have the same seed and drawn script at every mass and in every variant."""
    episode: Episode
    impulse: float = 0.0
    """Of the push on the base [N·s]; 0 without one."""


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


def sequence_for(recipe: Recipe, scene: str, own: Sequence[Segment] = ()) -> tuple[Segment, ...]:
    """The fixed commands in a scene: a sweep's or case's own, or else the recipe's, or else those of lifting or
    pushing."""
    return tuple(own) or recipe.eval.sequence or (PUSHING if _pushed(recipe, scene) else LIFTING)


def script_for(
    recipe: Recipe, scene: str, seed: int, own: Sequence[Segment] = (), repetitions: int = 1
) -> CommandScript:
    """The commands of the trial with a seed: fixed ones where a sequence is given or no scripts are drawn, else those
    drawn from the seed."""
    scripts, commands = recipe.eval.scripts, recipe.task.commands
    if own or recipe.eval.sequence or scripts is None:
        return command_script(sequence_for(recipe, scene, own) * repetitions, commands)
    pushing = _pushed(recipe, scene)
    parts = (drawn_script(scripts, commands, pushing=pushing, seed=seed, part=part) for part in range(repetitions))
    return CommandScript(tuple(segment for part in parts for segment in part.segments))


def _pushed(recipe: Recipe, scene: str) -> bool:
    return bool(getattr(recipe.simulation.scenes, scene).kind == "push")


def trial_seed(evaluation: Evaluation, number: int) -> int:
    """Seed of the trials of a number."""
    return SPLITS[evaluation.split] + evaluation.seed + number


@dataclass(frozen=True)
class Condition:
    """What trials at any mass have in common."""

    scene: str
    script: CommandScript
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Randomised quantities that are held, by name."""
    push: PlannedPush | None = None
    pull: PlannedPull | None = None

    def episode(self, mass: float, seed: int) -> Episode:
        """A mass of 0 is played in the scene without an object; what is not fixed is drawn."""
        held = dict(self.fixed) if mass == 0 else {**self.fixed, "object_mass": mass}
        scene = FREE if mass == 0 else self.scene
        return Episode(scene, seed, self.script.duration, held, self.script, self.push, self.pull)


def held_fixed(part: MassSweep | Case, partner_share: float | None, *, disturbed: bool) -> dict[str, float]:
    """The randomised quantities that a sweep or a case holds, by name."""
    held = {} if disturbed else dict(UNDISTURBED)
    if part.rolling_resistance is not None:
        held["object_ground_friction"] = part.rolling_resistance
    if partner_share is not None:
        held["partner_share"] = partner_share
    return held | part.fixed


@dataclass(frozen=True)
class PlannedSweep:
    """A sweep with one partner's share."""

    recipe: Recipe
    kind: str
    sweep: MassSweep
    """As it is with that share (`Sweep.at`)."""
    disturbed: bool
    """Whether impulses and pushes act."""
    no_object: bool = False
    """Whether the row without an object belongs to it."""

    @property
    def partner_share(self) -> float | None:
        """Of the partner; None draws it."""
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
        """The masses that the recipe names [kg], none below what the object can have."""
        thing = getattr(self.recipe.simulation.scenes, self.sweep.scene).object
        return tuple(dict.fromkeys(max(mass, thing.smallest_mass) for mass in self.sweep.masses))

    def named(self) -> list[Trial]:
        """The trials that the recipe names: those without an object, and those at each mass."""
        alone = self._trials(NO_OBJECT, (0.0,)) if self.no_object else []
        return alone + self.trials(self.masses)

    def trials(self, masses: Iterable[float]) -> list[Trial]:
        """The trials at some masses [kg]."""
        return self._trials(self.suite, masses)

    def _trials(self, case: str, masses: Iterable[float]) -> list[Trial]:
        fixed = held_fixed(self.sweep, self.partner_share, disturbed=self.disturbed)
        return [
            trial
            for mass in masses
            for trial in trials_of(
                self.recipe, (self.kind, self.suite, case), self.sweep.scene, mass, fixed, self.sweep.sequence
            )
        ]

    def heavier(self, last: float) -> float | None:
        """The next mass past the end of the sweep [kg], or None where the recipe stops."""
        beyond = self.sweep.beyond
        return None if beyond is None or last + beyond.step > beyond.limit else last + beyond.step


def trials_of(
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
) -> list[Trial]:
    """The trials of one cell; `place`: its kind, suite and case. `trials`: how many, by default `eval.trials`."""
    evaluation = recipe.eval
    found = []
    for number in range(trials or evaluation.trials):
        seed = trial_seed(evaluation, number)
        script = script_for(recipe, scene, seed, sequence, repetitions)
        episode = Condition(scene, script, fixed, push, pull).episode(mass, seed)
        found.append(Trial(*place, mass, number, episode, impulse))
    return found


def planned_sweeps(recipe: Recipe) -> list[PlannedSweep]:
    """The sweeps, each with every share of the partner's, then those without disturbances."""
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


def case_trials(recipe: Recipe) -> list[Trial]:
    """The trials of all single cases: heavy, stagnation, robustness."""
    evaluation = recipe.eval
    suites: dict[str, Sequence[Case]] = {
        "heavy": evaluation.heavy,
        "stagnation": () if evaluation.stagnation is None else evaluation.stagnation.cases,
        "robustness": () if evaluation.robustness is None else evaluation.robustness.cases,
    }
    return [
        trial
        for kind, cases in suites.items()
        for case in cases
        for trial in _trials_of_case(recipe, kind, case, disturbed=evaluation.disturbances)
    ]


def _trials_of_case(
    recipe: Recipe, kind: str, case: Case, *, disturbed: bool, trials: int | None = None
) -> list[Trial]:
    fixed = held_fixed(case, case.partner_share, disturbed=disturbed)
    return trials_of(
        recipe,
        (kind, kind, case.name),
        case.scene,
        case.mass,
        fixed,
        case.sequence,
        repetitions=case.repetitions,
        trials=trials,
    )


def push_trials(recipe: Recipe) -> list[Trial]:
    """The trials in which the base is pushed, standing and walking, at every size in every direction."""
    robustness = recipe.eval.robustness
    if robustness is None:
        return []
    ladders = {"": robustness.pushes, ", walking": robustness.walking_pushes}
    return [
        trial
        for words, ladder in ladders.items()
        if ladder is not None
        for direction in ladder.directions
        for impulse in ladder.impulses
        for trial in trials_of(
            recipe,
            ("pushes", "pushes", f"{direction}{words}"),
            ladder.scene,
            ladder.mass,
            UNDISTURBED | {"partner_share": 0.0},
            ladder.sequence,
            trials=ladder.trials,
            push=planned_push(ladder, direction, impulse),
            impulse=impulse,
        )
    ]


def planned_push(ladder: PushLadder, direction: str, impulse: float) -> PlannedPush:
    """A push of a ladder; `impulse` [N·s]."""
    forward, left = DIRECTIONS[direction]
    return PlannedPush(ladder.time, ladder.duration, (impulse * forward, impulse * left))


def compliance_trials(recipe: Recipe) -> list[Trial]:
    """The trials with partners of every behaviour and before a blocked crate, then those with pulls."""
    asked = recipe.eval.compliance
    if asked is None:
        return []
    found = [
        trial
        for share in asked.partner_shares
        for mass in asked.masses
        for behaviour in asked.behaviours
        for held in [{"partner_behaviour": float(BEHAVIOURS.index(behaviour)), "partner_share": share}]
        for suite in ["compliance" if len(asked.partner_shares) == 1 else f"compliance with partner {share:g}"]
        for trial in trials_of(
            recipe,
            ("compliance", suite, behaviour),
            asked.scene,
            mass,
            UNDISTURBED | held,
            asked.sequence,
            trials=asked.trials,
        )
    ]
    if asked.blocked is not None:
        found += _trials_of_case(recipe, "compliance", asked.blocked, disturbed=False, trials=asked.trials)
    return found + ([] if asked.impedance is None else _pulled(recipe, asked.impedance, asked.trials))


def _pulled(recipe: Recipe, asked: Impedance, trials: int | None) -> list[Trial]:
    """The trials with sinusoidal pulls."""
    found = []
    for axis in asked.directions:
        for frequency in asked.frequencies:
            duration = max(asked.cycles, math.ceil(asked.shortest * frequency)) / frequency
            force = (asked.amplitude * AXES[axis][0], asked.amplitude * AXES[axis][1])
            found += trials_of(
                recipe,
                ("impedance", "impedance", f"{axis} {frequency:g} Hz"),
                asked.scene,
                asked.mass,
                UNDISTURBED | {"partner_share": 0.0},
                (Segment(duration=asked.begin + duration, ramp=0.0), *asked.walk),
                trials=trials,
                pull=PlannedPull(asked.begin, duration, frequency, force),
            )
    return found


def map_trials(recipe: Recipe) -> list[Trial]:
    """The pushes at every rolling resistance and mass."""
    asked, evaluation = recipe.eval.map, recipe.eval
    if asked is None:
        return []
    calm = {} if evaluation.disturbances else UNDISTURBED
    return [
        trial
        for resistance in asked.rolling_resistances
        for mass in asked.masses
        for trial in trials_of(
            recipe,
            ("map", "map", f"μ {resistance:g}"),
            asked.scene,
            mass,
            calm | {"object_ground_friction": resistance, "partner_share": asked.partner_share},
            asked.sequence,
            trials=asked.trials,
        )
    ]
