"""Games in which trained skills and rivals are compared."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.section import COSMETIC, LATER, ArtifactName, Ascending, RecipeFile, Section
from iowbc.recipe.simulation.holding import ObjectScene

Rival = Literal["nominal", "follow", "lead", "clock", "stand"]
"""Rules of `iowbc.skill.plan.Plan` that act without a skill."""


class SkillEvaluation(Section):
    """Games in which trained skills and rivals are compared: every combination of what is listed here."""

    label: str = Field(default="MAPPO", min_length=1, max_length=40)
    """Name of this recipe's skill in tables and figures."""
    rivals: tuple[Rival, ...] = ("lead", "follow")
    """Rules that play beside it. `nominal`: the nominal command alone, which leads or follows. `lead`: a scripted
    leader, who knows the path in any case. `follow`: an admittance follower. `clock`: the path by the clock. `stand`:
    nothing."""
    others: dict[str, tuple[ArtifactName, ...]] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """By label: recipes whose trained skills play, too, or keys of theirs. Under this recipe's own label they are
    further trainings of it, such as other seeds. What they are is part of the key, not what they are called."""
    controllers: dict[str, RecipeFile] = Field(default_factory=dict, json_schema_extra=COSMETIC)
    """By label: recipes with `distill` whose student this recipe's skill also commands, in place of the controller that
    it was trained with. Each brings its references, command ranges, action scale, control frequency and reference
    generator; the world and the skill's observation stay those of this recipe."""
    tasks: tuple[str, ...] = ()
    """Tasks of `skill.tasks`; all where it is empty."""
    known: tuple[bool, ...] = (True, False)
    """Whether the robot knows the path, or only the human does."""
    partners: tuple[str, ...] = ()
    """Humans: scripted behaviours, and `agent` for the learnt one; those of training, those held out, and the learnt
    one where it is empty."""
    loads: tuple[float, ...] = Field(default=(0.5,), min_length=1)
    """Masses as places in the range of the task: 0 is its least, 1 its greatest."""
    masses: dict[ObjectScene, Ascending] = Field(default_factory=dict, json_schema_extra=LATER)
    """Masses of the tasks of a scene [kg], which may lie outside the range of the task; in place of `loads`."""
    episodes: int = Field(default=2, ge=1, le=1000)
    """Episodes of each combination."""
    seed: int = Field(default=7000, ge=0, lt=2**32)
    """Seed of the first episode; the same episodes for every skill and rival."""
    games: int = Field(default=48, ge=1, le=10_000, json_schema_extra=COSMETIC)
    """Games that are played at the same time."""
