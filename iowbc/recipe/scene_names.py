"""Validation of scene names in a recipe, and of the entries that custom scenes require."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from iowbc.errors import nearest
from iowbc.recipe.evaluation.evaluation import TrialScene
from iowbc.recipe.section import Problems, marked_fields
from iowbc.recipe.simulation.holding import WITH_OBJECT
from iowbc.recipe.simulation.scene import Scenes
from iowbc.recipe.task.task import Task

if TYPE_CHECKING:
    from iowbc.recipe.recipe import Recipe


def scene_name_problems(recipe: "Recipe") -> Problems:
    """Invalid scene names and incomplete custom scenes: pairs of a dotted path and a message."""
    simulation, task, evaluation = recipe.simulation, recipe.task, recipe.eval
    worlds = {"simulation.scenes": simulation.scenes}
    if evaluation.simulation is not None:
        worlds["eval.simulation.scenes"] = evaluation.simulation.scenes
    references = task.references
    named = tuple(dict.fromkeys(name for scenes in worlds.values() for name in scenes.names))
    yield from _unknown("task.scenes", task.scenes.own, simulation.scenes.names)
    for path, entries in (("task.references.grasps", references.grasps), ("task.references.loads", references.loads)):
        yield from _unknown(path, entries.own, named)
    for path, scenes in worlds.items():
        for name in scenes.own:
            yield from _incomplete(f"{path}.{name}", name, scenes, task)
    others = ((f"teacher.check.others.{name}", name) for name in recipe.teacher.check.others)
    for place, name in (
        *others,
        *marked_fields(recipe.export, "export", WITH_OBJECT),
        *marked_fields(recipe.skill, "skill", WITH_OBJECT),
    ):
        yield from _without_object(place, name, "simulation.scenes", simulation.scenes)
    path, scenes = list(worlds.items())[-1]
    if evaluation.scenes:
        path, scenes = f"{path} and eval.scenes", with_scenes(scenes, evaluation.scenes)
    for place, name in marked_fields(evaluation, "eval", WITH_OBJECT):
        yield from _without_object(place, name, path, scenes)


def with_scenes(scenes: Scenes, further: Mapping[str, TrialScene]) -> Scenes:
    """Scenes merged with those of the trials, which may replace some."""
    return Scenes.model_validate({**dict(scenes), **{name: own.scene for name, own in further.items()}})


def _unknown(path: str, names: tuple[str, ...], known: tuple[str, ...]) -> Problems:
    for name in names:
        if name not in known:
            text = f"no scene {name!r} in simulation.scenes; there are: {', '.join(known)}{nearest(name, known)}"
            yield f"{path}.{name}", text


def _incomplete(path: str, name: str, scenes: Scenes, task: Task) -> Problems:
    """Missing entries of a custom scene."""
    scene, references = getattr(scenes, name), task.references
    if name not in references.grasps.names:
        near = references.grasps.push if scene.kind == "push" else references.grasps.lift
        text = "has no base grasp: give the left wrist's place from the pelvis [m], for example"
        yield path, f"{text} task.references.grasps.{name}: {list(near)}"
    if name not in references.loads.names:
        half = 0.5 * scene.object.mass if scene.kind == "lift" else 0.0
        text = "does not say what the arms expect to carry [kg]: give, for example"
        yield path, f"{text} task.references.loads.{name}: {half:g}"


def _without_object(path: str, name: str, where: str, scenes: Scenes) -> Problems:
    loaded = [known for known in scenes.names if getattr(scenes, known).object is not None]
    if name not in loaded:
        text = f"no scene {name!r} with an object; valid: {', '.join(loaded)}; a mass of 0 is without one"
        yield path, f"{text}; see {where}{nearest(name, loaded)}"
