"""Inputs of the stages behind the reference generator."""

from collections.abc import Iterator, Sequence

from iowbc.recipe.recipe import Recipe


def generator_stage(recipe: Recipe) -> tuple[str, ...]:
    """`rg-fit` where a recipe fits a reference generator, else nothing. Also if θ_S_ref is the default posture:
    commands are clamped to the same map, so that variants with and without the generator meet the same trials."""
    return ("rg-fit",) if recipe.task.references.use_rg or "rg-fit" in recipe.stages else ()


def leaves_student(recipe: Recipe) -> bool:
    """True where a recipe trains a policy that needs no privileged observation."""
    return "distill" in recipe.stages or recipe.teacher.history is not None


def without_student(recipe: Recipe, stage: str) -> Iterator[tuple[str, str]]:
    """The problem of a stage that needs a student where no stage of the recipe trains one."""
    if not leaves_student(recipe):
        yield "stages", f"{stage} needs a student, and none of the stages trains one; add `distill`, or leave it out"


def not_privileged(recipe: Recipe, path: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Problems of a stage: names at a dotted recipe path that are not in s_priv."""
    if not names:
        return
    from iowbc.task.privileged import PRIVILEGED

    parts = [*(part.name for part in PRIVILEGED), *recipe.task.observation.own]
    for name in names:
        if name not in parts:
            yield path, f"{name!r} is no part of s_priv: {', '.join(parts)}"


def policy_stage(recipe: Recipe) -> str:
    """The stage that trains the deployed policy: `distill` if there is one, else `teacher`."""
    return "distill" if "distill" in recipe.stages else "teacher"
