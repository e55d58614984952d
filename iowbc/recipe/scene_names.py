"""Whether all that goes by scene names one that there is, and whether a recipe's own scenes have all they need."""

from collections.abc import Iterator, Mapping
from typing import Any

from iowbc.errors import nearest
from iowbc.recipe.evaluation.evaluation import Evaluation, TrialScene
from iowbc.recipe.export import Export
from iowbc.recipe.simulation.scene import Scenes
from iowbc.recipe.simulation.simulation import Simulation
from iowbc.recipe.task.task import Task
from iowbc.recipe.teacher import Teacher


def misnamed(
    simulation: Simulation, task: Task, teacher: Teacher, evaluation: Evaluation, export: Export
) -> Iterator[tuple[str, str]]:
    """Dotted paths, and what is wrong there."""
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
    for place, name in _trained(teacher, export):
        yield from _without_object(place, name, "simulation.scenes", simulation.scenes)
    path, scenes = list(worlds.items())[-1]
    if evaluation.scenes:
        path, scenes = f"{path} and eval.scenes", with_scenes(scenes, evaluation.scenes)
    for place, name in _evaluated(evaluation):
        yield from _without_object(place, name, path, scenes)


def with_scenes(scenes: Scenes, further: Mapping[str, TrialScene]) -> Scenes:
    """Scenes with those of the trials, which may replace some."""
    return Scenes.model_validate({**dict(scenes), **{name: own.scene for name, own in further.items()}})


def _unknown(path: str, names: tuple[str, ...], known: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    for name in names:
        if name not in known:
            text = f"no scene {name!r} in simulation.scenes; there are: {', '.join(known)}{nearest(name, known)}"
            yield f"{path}.{name}", text


def _incomplete(path: str, name: str, scenes: Scenes, task: Task) -> Iterator[tuple[str, str]]:
    """What a scene of a recipe's own lacks."""
    scene, references = getattr(scenes, name), task.references
    if name not in references.grasps.names:
        near = references.grasps.push if scene.kind == "push" else references.grasps.lift
        text = "has no base grasp: give the left wrist's place from the pelvis [m], for example"
        yield path, f"{text} task.references.grasps.{name}: {list(near)}"
    if name not in references.loads.names:
        half = 0.5 * scene.object.mass if scene.kind == "lift" else 0.0
        text = "does not say what the arms expect to carry [kg]: give, for example"
        yield path, f"{text} task.references.loads.{name}: {half:g}"


def _without_object(path: str, name: str, where: str, scenes: Scenes) -> Iterator[tuple[str, str]]:
    loaded = [known for known in scenes.names if getattr(scenes, known).object is not None]
    if name not in loaded:
        text = f"no scene {name!r} with an object; valid: {', '.join(loaded)}; a mass of 0 is without one"
        yield path, f"{text}; see {where}{nearest(name, loaded)}"


def _trained(teacher: Teacher, export: Export) -> Iterator[tuple[str, str]]:
    """Places that name a scene of the training's world."""
    for name in teacher.check.others:
        yield f"teacher.check.others.{name}", name
    for number, acceptance in enumerate(export.acceptance):
        yield f"export.acceptance.{number}.scene", acceptance.scene


def _evaluated(evaluation: Evaluation) -> Iterator[tuple[str, str]]:
    """Places that name a scene of the world of trials."""
    for path, sweep in evaluation.sweeps.items():
        yield f"eval.{path}.scene", sweep.scene
    suites = {
        "heavy": evaluation.heavy,
        "stagnation.cases": () if evaluation.stagnation is None else evaluation.stagnation.cases,
        "robustness.cases": () if evaluation.robustness is None else evaluation.robustness.cases,
    }
    for path, cases in suites.items():
        for number, case in enumerate(cases):
            yield f"eval.{path}.{number}.scene", case.scene
    parts: dict[str, Any] = {"compliance": evaluation.compliance, "map": evaluation.map, "probe": evaluation.probe}
    if (robustness := evaluation.robustness) is not None:
        parts |= {"robustness.pushes": robustness.pushes, "robustness.walking_pushes": robustness.walking_pushes}
    if (compliance := evaluation.compliance) is not None:
        parts |= {"compliance.blocked": compliance.blocked, "compliance.impedance": compliance.impedance}
    yield from ((f"eval.{path}.scene", part.scene) for path, part in parts.items() if part is not None)
