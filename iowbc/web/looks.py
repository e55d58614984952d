"""The page's drawing of a scene: the shapes of the bodies, for the eye."""

from typing import Any

import mujoco

SHOWN = 2
"""Highest group of geoms that MuJoCo's viewer draws at first."""
SHAPES = {
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
}


def looks(dressed: Any, stepped: Any) -> list[dict[str, Any]]:
    """Shapes of the model `dressed` for the eye, each with its body in the model that is `stepped`.

    Half sizes and positions in m in the body's frame; quaternions wxyz; colours red, green, blue, alpha in 0 to 1.
    """
    found = []
    for index in range(dressed.ngeom):
        shape = SHAPES.get(mujoco.mjtGeom(dressed.geom_type[index]))
        if shape is None or dressed.geom_group[index] > SHOWN or dressed.geom_rgba[index, 3] == 0.0:
            continue
        body = stepped.body(dressed.body(dressed.geom_bodyid[index]).name).id
        found.append(
            {
                "body": int(body),
                "shape": shape,
                "size": [round(value, 5) for value in dressed.geom_size[index].tolist()],
                "position": [round(value, 5) for value in dressed.geom_pos[index].tolist()],
                "quaternion": [round(value, 6) for value in dressed.geom_quat[index].tolist()],
                "colour": [round(value, 3) for value in dressed.geom_rgba[index].tolist()],
            }
        )
    return found
