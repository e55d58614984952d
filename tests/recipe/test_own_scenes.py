"""A recipe may add scenes with names of its own, and is told what they lack and where a name is wrong."""

import copy
import json
import os
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from iowbc.errors import RecipeError
from iowbc.pipeline.nested import nested
from iowbc.recipe.reading.document import as_yaml
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe, recipe_schema
from iowbc.recipe.section import deciding
from iowbc.recipe.task.task import SceneShares
from iowbc.task.vector.setup import scene_of

BARREL: dict[str, Any] = {
    "simulation.scenes.barrel": {
        "kind": "lift",
        "object": {"shape": "cylinder", "size": [0.3, 0.3, 0.4], "mass": 6.0},
    },
    "task.scenes.barrel": 0.5,
    "task.references.grasps.barrel": [0.3, 0.16, 0.26],
    "task.references.loads.barrel": 3.0,
    "eval.lifting": {"scene": "barrel", "masses": [6.0]},
    "export.acceptance": [{"scene": "barrel", "mass": 6.0}],
    "teacher.check.others": {"barrel": [6.0]},
}
TETRAHEDRON = "v 0 0 0\nv .3 0 0\nv 0 .4 0\nv 0 0 .5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def written(folder: Path, values: dict[str, Any]) -> Path:
    file = folder / "mine.yaml"
    file.write_text(yaml.safe_dump(nested(copy.deepcopy(values))))
    return file


def test_a_scene_of_ones_own_is_named_wherever_scenes_are(tmp_path: Path) -> None:
    recipe = load_recipe(written(tmp_path, BARREL)).recipe
    assert recipe.simulation.scenes.names == ("free", "lift", "squeeze", "tyre", "push", "barrel")
    assert recipe.task.scenes.barrel == 0.5
    assert deciding(recipe)["simulation"]["scenes"]["barrel"]["object"]["size"] == [0.3, 0.3, 0.4]
    assert Recipe.model_validate(yaml.safe_load(as_yaml(recipe))) == recipe
    jsonschema.validate(nested(json.loads(json.dumps(BARREL))), recipe_schema())


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"task.scenes.barell": 1.0}, "no scene 'barell' in simulation.scenes; .* did you mean 'barrel'"),
        ({"eval.lifting": {"scene": "barell"}}, "'eval.lifting.scene' = 'barell': no scene 'barell' with an object"),
        ({"eval.simulation": {}}, "no scene 'barrel' with an object; .*; see eval.simulation.scenes"),
        ({"teacher.check.others": {"barel": [1.0]}}, "did you mean 'barrel'"),
        ({"task.references.grasps.barrel": None}, "has no base grasp: .* task.references.grasps.barrel: "),
        ({"task.references.loads.barrel": None}, "expect to carry .* task.references.loads.barrel: 3"),
        ({"simulation.scenes.lfit": {"object": {"mass": 9.0}}}, "lfit.kind': is missing .* did you mean 'lift'"),
        ({"simulation.scenes.a-b": {"kind": "free"}}, "'a-b' is no name"),
        ({"simulation.scenes.copy": {"kind": "free"}}, "'copy' is a word"),
        ({"simulation.scenes.barrel.object.size": [0.3, 0.4, 0.4]}, "as long as it is wide"),
        ({"simulation.scenes.barrel.grasp.kind": "contact"}, "holds a box"),
        ({"simulation.scenes.barrel.object.shape": "mesh"}, "give its file, `mesh`"),
        ({"simulation.scenes.barrel.object.mesh": "gone.obj"}, r"gone.obj: cannot be read: No such file"),
        ({"simulation.scenes.barrel.object.mesh": "mine.yaml"}, "ends in .obj or .stl"),
    ],
)
def test_what_is_wrong_with_a_scene_of_ones_own_is_told(tmp_path: Path, changes: dict[str, Any], text: str) -> None:
    values = {path: value for path, value in {**BARREL, **changes}.items() if value is not None}
    with pytest.raises(RecipeError, match=text) as caught:
        load_recipe(written(tmp_path, values))
    assert all(problem.place.startswith(f"{tmp_path / 'mine.yaml'}:") for problem in caught.value.problems)


def test_a_file_that_is_none_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.obj")
    with pytest.raises(RecipeError, match=r"pipe\.obj: is no regular file"):
        load_recipe(written(tmp_path, {**BARREL, "simulation.scenes.barrel.object.mesh": "pipe.obj"}))


def test_a_mesh_is_taken_into_the_recipe_and_its_content_is_in_the_key(tmp_path: Path) -> None:
    crag = {"shape": "mesh", "size": None, "mesh": "crag.obj", "mass": 3.0}
    file = written(tmp_path, {**BARREL, "simulation.scenes.barrel.object": crag})

    def mesh() -> tuple[Recipe, dict[str, Any]]:
        recipe = load_recipe(file).recipe
        return recipe, deciding(recipe)["simulation"]["scenes"]["barrel"]["object"]["mesh"]

    (tmp_path / "crag.obj").write_text(TETRAHEDRON)
    recipe, before = mesh()
    (tmp_path / "crag.obj").write_text(TETRAHEDRON + "# another\n")
    _, after = mesh()
    assert set(before) == {"sha256"}
    assert before != after
    taken = Recipe.model_validate(yaml.safe_load(as_yaml(recipe))).simulation.scenes.barrel.object.mesh
    assert taken.unpacked() == TETRAHEDRON.encode()
    (tmp_path / "crag.obj").write_bytes(bytes(taken.largest + 1))
    with pytest.raises(RecipeError, match="has 400,001 bytes; it may have 400,000 at most"):
        mesh()


def test_a_recipe_whose_mesh_was_altered_is_refused(tmp_path: Path) -> None:
    (tmp_path / "crag.obj").write_text(TETRAHEDRON)
    crag = {"shape": "mesh", "mesh": "crag.obj", "mass": 3.0}
    values = load_recipe(written(tmp_path, {**BARREL, "simulation.scenes.barrel.object": crag})).recipe.model_dump()
    values["simulation"]["scenes"]["barrel"]["object"]["mesh"]["sha256"] = "0" * 64
    with pytest.raises(ValueError, match="not that of its digest"):
        Recipe.model_validate(values)


def test_the_order_of_custom_scenes_in_a_file_decides_nothing() -> None:
    shares = [("barrel", 0.5), ("plank", 0.5)]
    first, second = (SceneShares.model_validate(dict(ordered)) for ordered in (shares, shares[::-1]))
    assert list(first) == list(second)
    assert scene_of(8, first) == scene_of(8, second)
