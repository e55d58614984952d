"""Objects of a recipe's own: cylinders, and meshes from a file."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from iowbc.errors import UsageError
from iowbc.recipe.beside import MeshFile
from iowbc.recipe.section import Vector
from iowbc.recipe.simulation.scene import Object, Scene
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.robot.description import GRAVITY
from iowbc.sim.objects import measured
from iowbc.sim.simulation import Simulation

SIZE = (0.3, 0.2, 0.4)
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * SIZE + (5.0, 6.0, 7.0)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box_file(folder: Path, ending: str) -> MeshFile:
    """A box whose corner lies far off the origin."""
    triangles = [(side[0], side[k], side[k + 1]) for side in SIDES for k in (1, 2)]
    if ending == "obj":
        lines = [f"v {x} {y} {z}" for x, y, z in CORNERS] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
        data = "\n".join(lines).encode()
    else:
        facets = [struct.pack("<12fH", 0, 0, 0, *CORNERS[list(corners)].ravel(), 0) for corners in triangles]
        data = bytes(80) + struct.pack("<I", len(triangles)) + b"".join(facets)
    (folder / f"box.{ending}").write_bytes(data)
    return MeshFile.taken_in(folder / f"box.{ending}", f"box.{ending}")


@pytest.mark.parametrize("ending", ["obj", "stl"])
def test_a_mesh_of_a_box_is_that_box(tmp_path: Path, ending: str) -> None:
    mesh = measured(Object(shape="mesh", mesh=box_file(tmp_path, ending), mass=2.0))
    box = measured(Object(shape="box", size=SIZE, mass=2.0))
    for name in ("low", "high", "about_axes"):
        assert getattr(mesh, name) == pytest.approx(getattr(box, name), abs=1e-6), name


def test_a_scale_turns_millimetres_into_metres(tmp_path: Path) -> None:
    small = measured(Object(shape="mesh", mesh=box_file(tmp_path, "obj"), scale=0.5, mass=2.0))
    assert small.high - small.low == pytest.approx(0.5 * np.array(SIZE), abs=1e-6)


def test_a_cylinder_has_the_inertia_that_mujoco_computes() -> None:
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.2, 0.3, 0.0], mass=1.0)
    cylinder = measured(Object(shape="cylinder", size=(0.4, 0.4, 0.6), mass=3.0))
    assert cylinder.principal == pytest.approx(spec.compile().body_inertia[1])


CUBE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.mark.parametrize(
    "text",
    [CUBE.replace("1 0 0", "nan 0 0"), CUBE.replace("1 0 0", "1e30 0 0"), CUBE.replace("1", "1e-5", 3)]
    + [f"{CUBE}f 1 2 {index}\n" for index in (99_999_999, -9)]
    + ["no mesh"],
)
def test_a_mesh_that_no_hands_can_hold_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "odd.obj").write_text(text)
    with pytest.raises(
        UsageError, match=r"odd.obj: (no object that MuJoCo can weigh|extends over .* expected 0.001 to)"
    ):
        measured(Object(shape="mesh", mesh=MeshFile.taken_in(tmp_path / "odd.obj", "odd.obj"), mass=1.0))


def test_a_mesh_without_volume_is_named(tmp_path: Path) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    flat = MeshFile.taken_in(tmp_path / "flat.obj", "flat.obj")
    with pytest.raises(UsageError, match=r"flat.obj: no object that MuJoCo can weigh"):
        measured(Object(shape="mesh", mesh=flat, mass=1.0))


def with_scene(recipe: Recipe, scene: Scene) -> Recipe:
    scenes = type(recipe.scenes).model_validate({**recipe.scenes.model_dump(), "mine": scene})
    return recipe.model_copy(update={"scenes": scenes})


CYLINDER: Vector = (0.3, 0.3, 0.4)


@pytest.mark.parametrize("shape", ["cylinder", "mesh"])
def test_hands_carry_an_object_of_ones_own(
    start: Callable[..., Simulation], hold_base: Any, by_hands: Recipe, tmp_path: Path, shape: str
) -> None:
    thing = Object(shape="cylinder", size=CYLINDER, mass=3.0)
    if shape == "mesh":
        thing = Object(shape="mesh", mesh=box_file(tmp_path, "obj"), mass=3.0)
    hold_base()
    simulation = start(with_scene(by_hands, Scene(kind="lift", object=thing)), ["mine"])
    for _ in range(100):
        simulation.step()
    assert simulation.state.grasped.all()
    assert simulation.state.grip_force[0, :, 2].sum() == pytest.approx(-3.0 * GRAVITY, rel=0.1)


@pytest.mark.parametrize("shape", ["cylinder", "mesh"])
def test_a_crate_of_ones_own_stands_a_gap_before_the_palms(
    start: Callable[..., Simulation], calm: Recipe, tmp_path: Path, shape: str
) -> None:
    thing = Object(shape="cylinder", size=CYLINDER, mass=30.0)
    if shape == "mesh":
        thing = Object(shape="mesh", mesh=box_file(tmp_path, "obj"), mass=30.0)
    scene = Scene(kind="push", object=thing, palm=(0.11, 0.0, 0.0))
    simulation = start(with_scene(calm, scene), ["mine", "push"])
    face = simulation.state.object_position[:, 0] - 0.5 * np.array([0.3, 0.7])
    assert face[0] == pytest.approx(face[1], abs=1e-6)
