"""Pictures."""

import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from stepping import run

from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.sim.rendering import appearance as look
from iowbc.sim.rendering import offscreen
from iowbc.sim.rendering.forces import COLOURS, SMALLEST_FORCE
from iowbc.sim.rendering.offscreen import MARGIN
from iowbc.sim.rendering.renderer import SceneRenderer


@pytest.mark.parametrize("scene", ["free", "lift", "tyre", "push"])
def test_a_frame_shows_robot_and_object(start, scene, monkeypatch):
    monkeypatch.setattr(look, "installed_meshes", lambda robot: iter(()))
    simulation = start(Recipe(), [scene])
    with SceneRenderer(simulation, 0, width=160, height=120) as renderer:
        frame = renderer.frame()
        again = renderer.frame()
    assert frame.shape == (120, 160, 3)
    assert frame.dtype == np.uint8
    assert len(np.unique(frame.reshape(-1, 3), axis=0)) > 100
    assert frame.std() > 10.0
    assert np.abs(frame.astype(int) - again).mean() < 10.0


def test_the_camera_follows_the_robot(start, monkeypatch):
    monkeypatch.setattr(look, "installed_meshes", lambda robot: iter(()))
    simulation = start(Recipe(), ["free"])
    with SceneRenderer(simulation, 0, width=64, height=48) as renderer:
        before = renderer.camera.lookat.copy()
        simulation.state.base_position[0, 0] += 10.0
        for _ in range(60):
            renderer.frame()
        assert renderer.camera.lookat[0] > before[0] + 9.0


def test_the_camera_sees_the_robot_from_its_side_whatever_its_heading(start, calm, monkeypatch):
    monkeypatch.setattr(look, "installed_meshes", lambda robot: iter(()))
    azimuths = []
    for yaw in (0.0, 1.0):
        simulation = start(calm, ["push"], start_yaw=yaw)
        with SceneRenderer(simulation, 0, width=64, height=48) as renderer:
            azimuths.append(np.radians(renderer.camera.azimuth) - yaw)
    np.testing.assert_allclose(azimuths[1], azimuths[0], atol=1e-6)


def test_lines_are_drawn_on_the_ground_as_far_as_there_is_room(start, monkeypatch):
    monkeypatch.setattr(look, "installed_meshes", lambda robot: iter(()))
    simulation = start(Recipe(), ["free"])
    for points in (3, 2 * MARGIN):
        line = np.zeros((points, 3)), (1.0, 0.0, 0.0, 1.0)
        with SceneRenderer(simulation, 0, width=64, height=48, lines=[line]) as renderer:
            renderer.frame()
            kinds = [geom.type for geom in renderer.scene.geoms[: renderer.scene.ngeom]]
            assert kinds.count(mujoco.mjtGeom.mjGEOM_CAPSULE.value) >= 2
            assert renderer.scene.ngeom <= renderer.scene.maxgeom


def test_forces_are_drawn_as_arrows(start, monkeypatch):
    monkeypatch.setattr(look, "installed_meshes", lambda robot: iter(()))
    simulation = start(Recipe(), ["lift"], partner_share=0.5)
    run(simulation, 30)
    with SceneRenderer(simulation, 0, width=64, height=48) as renderer:
        renderer.frame()
        assert _arrows(renderer, "grip") == 2


def test_the_object_is_handed_over_without_an_arrow_of_a_disturbance(start, calm, monkeypatch):
    monkeypatch.setattr(look, "installed_meshes", lambda robot: iter(()))
    simulation = start(calm, ["lift"], object_mass=6.0)
    simulation.step()
    assert simulation.state.external_force[0, 2] > 10 * SMALLEST_FORCE
    with SceneRenderer(simulation, 0, width=64, height=48) as renderer:
        renderer.frame()
        assert _arrows(renderer, "push") == 0
        simulation._impulses.force[0] = (40.0, 0.0, 0.0)
        renderer.frame()
        assert _arrows(renderer, "push") == 1


def _arrows(renderer, kind):
    colours = np.array([renderer.scene.geoms[index].rgba for index in range(renderer.scene.ngeom)])
    return int(np.sum(np.all(np.isclose(colours, COLOURS[kind]), axis=1)))


def test_meshes_sit_on_the_links_of_the_robot_where_they_are_installed(robot):
    meshes = {mesh.link: mesh for mesh in look.installed_meshes(robot)}
    if not meshes:
        pytest.skip("example-robot-data has no meshes of this robot here")
    assert meshes["left_knee_link"].body == "left_knee_link"
    assert meshes["head_link"].body == "torso_link"
    assert all(mesh.file.is_file() for mesh in meshes.values())


def test_drawing_switched_off_says_how_to_switch_it_on(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(offscreen.NoRenderer, match="unset it or set it to one of egl, osmesa"):
        offscreen.backend()


@pytest.mark.parametrize("asked", ["osmesa", "egl", "nonsense"])
def test_a_command_loads_the_simulation_and_says_why_nothing_is_drawn(asked):
    program = (
        "from iowbc.__main__ import load_no_graphics\n"
        "load_no_graphics()\n"
        "import mujoco\n"
        "from iowbc.sim.rendering import offscreen\n"
        "offscreen.ctypes.util.find_library = lambda name: None\n"
        "mujoco.mj_step(*(lambda m: (m, mujoco.MjData(m)))(mujoco.MjModel.from_xml_string('<mujoco/>')))\n"
        "try:\n    offscreen.context(8, 8)\n"
        "except offscreen.NoRenderer as error:\n    print(error)\n"
    )
    environment = os.environ | {"MUJOCO_GL": asked, "PYOPENGL_PLATFORM": "glx"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"MUJOCO_GL={asked}")


def test_without_libraries_the_error_names_the_package(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(offscreen.ctypes.util, "find_library", lambda name: None)
    with pytest.raises(offscreen.NoRenderer, match="apt-get install libosmesa6"):
        offscreen.backend()


def test_a_picture_larger_than_the_buffer_is_refused(start):
    with pytest.raises(ValueError, match="larger than 1920 x 1088"):
        SceneRenderer(start(Recipe(), ["free"]), 0, width=4000, height=100)
