"""Which trials an evaluation consists of: sweeps, cases, seeds, and what is held fixed in each."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.evaluation.sequences import LIFTING, PUSHING
from iowbc.recipe.evaluation.suites import Case, PushLadder, Sweep
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.recipe.task.commands import Commands
from iowbc.task.commands.script import CommandScript, CommandSegment
from iowbc.task.episodes import Episode, PlannedPush

UNDISTURBED = {"impulse_scale": 0.0, "push_scale": 0.0}
"""Factors on the impulses on the object and the pushes on the base."""
DIRECTIONS = {"forward": (1.0, 0.0), "backward": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)}
"""Of pushes on the base, heading frame."""


@dataclass(frozen=True)
class Trial:
    """One trial: where it stands in the tables, and the episode it plays."""

    kind: str
    """"lifting", "pushing", "heavy", "stagnation", "robustness", "pushes", or another word for what is asked."""
    suite: str
    """The table it belongs to: the kind, and with what partner."""
    case: str
    """Name within the suite; that of the suite for a sweep."""
    mass: float
    """Object mass [kg]."""
    number: int
    """0, 1, ...: trials of the same number have the same seed at every mass and in every variant."""
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
    """The commands in a scene: a sweep's or case's own, or else the recipe's, or else those of lifting or pushing."""
    pushed = getattr(recipe.simulation.scenes, scene).kind == "push"
    return tuple(own) or recipe.eval.sequence or (PUSHING if pushed else LIFTING)


@dataclass(frozen=True)
class Condition:
    """What trials at any mass have in common."""

    scene: str
    script: CommandScript
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Randomised quantities that are held, by name."""
    push: PlannedPush | None = None

    def episode(self, mass: float, seed: int) -> Episode:
        """A mass of 0 is played in the scene without an object; what is not fixed is drawn."""
        held = dict(self.fixed) if mass == 0 else {**self.fixed, "object_mass": mass}
        scene = FREE if mass == 0 else self.scene
        return Episode(scene, seed, self.script.duration, held, self.script, self.push)


def held_fixed(evaluation: Evaluation, part: Sweep | Case, partner_share: float | None) -> dict[str, float]:
    """The randomised quantities that a sweep or a case holds, by name."""
    held = {} if evaluation.disturbances else dict(UNDISTURBED)
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
    sweep: Sweep
    partner_share: float | None

    @property
    def suite(self) -> str:
        """Name of its table."""
        if self.partner_share == 0:
            return self.kind
        return (
            f"{self.kind} with {'drawn partner' if self.partner_share is None else f'partner {self.partner_share:g}'}"
        )

    def trials(self, masses: Iterable[float]) -> list[Trial]:
        """The trials at some masses [kg]."""
        evaluation, sweep = self.recipe.eval, self.sweep
        script = command_script(sequence_for(self.recipe, sweep.scene, sweep.sequence), self.recipe.task.commands)
        condition = Condition(sweep.scene, script, held_fixed(evaluation, sweep, self.partner_share))
        return [
            Trial(self.kind, self.suite, self.suite, mass, number, condition.episode(mass, evaluation.seed + number))
            for mass in masses
            for number in range(evaluation.trials)
        ]

    def heavier(self, last: float) -> float | None:
        """The next mass past the end of the sweep [kg], or None where the recipe stops."""
        beyond = self.sweep.beyond
        return None if beyond is None or last + beyond.step > beyond.limit else last + beyond.step


def planned_sweeps(recipe: Recipe) -> list[PlannedSweep]:
    """The sweeps of lifting and pushing, each with every share of the partner's."""
    asked = {"lifting": recipe.eval.lifting, "pushing": recipe.eval.pushing}
    return [
        PlannedSweep(recipe, kind, sweep, share)
        for kind, sweep in asked.items()
        if sweep is not None
        for share in sweep.partner_shares
    ]


def case_trials(recipe: Recipe) -> list[Trial]:
    """The trials of all single cases: heavy, stagnation, robustness."""
    evaluation = recipe.eval
    suites: dict[str, Sequence[Case]] = {
        "heavy": evaluation.heavy,
        "stagnation": () if evaluation.stagnation is None else evaluation.stagnation.cases,
        "robustness": () if evaluation.robustness is None else evaluation.robustness.cases,
    }
    return [trial for kind, cases in suites.items() for case in cases for trial in _trials_of(recipe, kind, case)]


def _trials_of(recipe: Recipe, kind: str, case: Case) -> list[Trial]:
    evaluation = recipe.eval
    sequence = sequence_for(recipe, case.scene, case.sequence) * case.repetitions
    script = command_script(sequence, recipe.task.commands)
    condition = Condition(case.scene, script, held_fixed(evaluation, case, case.partner_share))
    return [
        Trial(kind, kind, case.name, case.mass, number, condition.episode(case.mass, evaluation.seed + number))
        for number in range(evaluation.trials)
    ]


def push_trials(recipe: Recipe) -> list[Trial]:
    """The trials in which the base is pushed, at every size in every direction."""
    robustness, evaluation = recipe.eval.robustness, recipe.eval
    if robustness is None or robustness.pushes is None:
        return []
    ladder = robustness.pushes
    script = command_script(ladder.sequence, recipe.task.commands)
    fixed = {**UNDISTURBED, "partner_share": 0.0}
    return [
        Trial("pushes", "pushes", direction, ladder.mass, number, episode, impulse)
        for direction in ladder.directions
        for impulse in ladder.impulses
        for number in range(evaluation.trials)
        for condition in [Condition(ladder.scene, script, fixed, planned_push(ladder, direction, impulse))]
        for episode in [condition.episode(ladder.mass, evaluation.seed + number)]
    ]


def planned_push(ladder: PushLadder, direction: str, impulse: float) -> PlannedPush:
    """A push of a ladder; `impulse` [N·s]."""
    forward, left = DIRECTIONS[direction]
    return PlannedPush(ladder.time, ladder.duration, (impulse * forward, impulse * left))
