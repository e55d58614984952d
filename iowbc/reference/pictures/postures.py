"""Picture of rendered support postures over height and torso pitch."""

from itertools import product
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from matplotlib.figure import Figure

from iowbc.errors import Rejected
from iowbc.reference.labels.checks import LabelChecker
from iowbc.reference.labels.gauss_newton import StaticMethod
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.labels.support_model import Posture, Sample, SupportModel
from iowbc.results.picture import write_figure
from iowbc.robot.description import Robot
from iowbc.sim.rendering.offscreen import Image, Offscreen

HEIGHTS, PITCHES = 4, 7
"""Rows and columns of postures."""
SIZE = 260
"""Width and height of a rendered posture [pixel]."""
AZIMUTH, ELEVATION, DISTANCE, LOOK_AT = 125.0, -12.0, 1.9, (0.1, 0.0, 0.58)
"""Camera [degree, degree, m, m]."""
EMPTY = 235
"""Grey of a command without a label."""


def draw_strip(path: Path, plan: SamplePlan) -> None:
    """Labels a small grid by the static method and draws it, with the arms in the default posture, or with the wrists
    kept ahead of the pelvis if that has no label. Raises NoRenderer."""
    robot, recipe = plan.robot, plan.recipe
    heights = np.interp((np.arange(HEIGHTS)[::-1] + 0.5) / HEIGHTS, [0.0, 1.0], plan.heights[[0, -1]])
    places = np.linspace(0, len(plan.pitches) - 1, PITCHES).round().astype(int)
    support, model = SupportModel(robot, recipe.problem, recipe.height), _scene(robot)
    method, judge = StaticMethod(support), LabelChecker(support, recipe.gates)
    figure = Figure(figsize=(1.75 * PITCHES, 1.85 * HEIGHTS), layout="constrained")
    axes = figure.subplots(HEIGHTS, PITCHES)
    with Offscreen(
        model, width=SIZE, height=SIZE, distance=DISTANCE, azimuth=AZIMUTH, elevation=ELEVATION
    ) as offscreen:
        offscreen.camera.lookat[:] = LOOK_AT
        for axis, (height, place) in zip(axes.flat, product(heights, places), strict=True):
            axis.axis("off")
            axis.set_title(f"{height:.2f} m, {plan.pitches[place]:+.2f} rad", fontsize=8)
            for arms in plan.grid_arms[:, place]:
                sample = Sample(arms, np.array([height, plan.pitches[place]]))
                try:
                    posture = method.solve(sample)
                    judge.label(sample, posture)
                except Rejected as rejected:
                    reason = str(rejected)
                    continue
                axis.imshow(_picture(offscreen, model, robot, sample, posture))
                break
            else:
                axis.imshow(np.full((SIZE, SIZE, 3), EMPTY, dtype=np.uint8))
                axis.text(0.5, 0.5, reason, ha="center", va="center", transform=axis.transAxes, fontsize=8)
    title = f"Support postures by {recipe.height} height and torso pitch (grey: no label, and why)"
    figure.suptitle(title, fontsize=11)
    write_figure(figure, path)


def _picture(offscreen: Offscreen, model: Any, robot: Robot, sample: Sample, posture: Posture) -> Image:
    """The posture as an image, shape (SIZE, SIZE, 3)."""
    data = mujoco.MjData(model)
    data.qpos[:3] = posture.configuration[:3]
    data.qpos[3:7] = np.roll(posture.configuration[3:7], 1)
    data.qpos[7 + robot.support] = posture.support
    data.qpos[7 + robot.interaction] = sample.arm
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    return offscreen.draw(data)


def _scene(robot: Robot) -> Any:
    """The robot on a plain floor."""
    spec = mujoco.MjSpec.from_file(str(robot.mjcf))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = SIZE, SIZE
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (0.45, 0.45, 0.45), (0.5, 0.5, 0.5)
    floor = spec.worldbody.add_geom()
    floor.type, floor.size, floor.rgba = mujoco.mjtGeom.mjGEOM_PLANE, (3.0, 3.0, 0.1), (0.93, 0.94, 0.96, 1.0)
    sky = spec.add_texture()
    sky.type, sky.builtin = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    sky.rgb1, sky.rgb2, sky.width, sky.height = (1.0, 1.0, 1.0), (0.86, 0.89, 0.93), 64, 384
    light = spec.worldbody.add_light()
    light.pos, light.dir, light.castshadow = (1.0, -1.0, 3.0), (-0.3, 0.3, -1.0), True
    light.diffuse, light.specular = (0.35, 0.35, 0.35), (0.1, 0.1, 0.1)
    return spec.compile()
