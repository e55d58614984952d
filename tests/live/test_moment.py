"""What is taken down of an environment."""

import mujoco
import numpy as np
import pytest

from iowbc.live.drawing import collision_shapes, looks
from iowbc.live.session import Session
from iowbc.robot.description import GRAVITY


def run(session: Session, steps: int) -> None:
    for _ in range(steps):
        session.step()


def test_bodies_are_where_the_simulation_has_them(session: Session) -> None:
    run(session, 10)
    data = session.environment.batch.simulation.physics_model(0)[1]
    moment, shown = session.track.moments[-1], session.track.model
    for body in ("pelvis", "left_wrist_yaw_link", "right_ankle_roll_link", "object"):
        assert moment.bodies[shown.body(body).id, :3] == pytest.approx(data.body(body).xpos, abs=1e-6)
        assert moment.bodies[shown.body(body).id, 3:] == pytest.approx(data.body(body).xquat, abs=1e-6)


def test_a_standing_robot_has_its_weight_over_and_on_its_feet(session: Session) -> None:
    run(session, 4)
    moment = session.track.moments[-1]
    assert moment.support.shape[0] >= 4
    following = np.roll(moment.support, -1, axis=0)
    edges, towards = following - moment.support, moment.balance - moment.support
    assert (edges[:, 0] * towards[:, 1] - edges[:, 1] * towards[:, 0] > 0).all()
    run(session, 16)
    settled = session.track.moments[-1]
    total = sum(force.force[2] for force in settled.forces if force.kind == "ground")
    mass = session.environment.batch.simulation.world_of(0)[0].robot_mass[0]
    assert total == pytest.approx(GRAVITY * mass + session.track.held_weight, rel=0.25)


def test_the_reference_is_the_posture_at_the_start_and_parts_from_it_when_pushed(session: Session) -> None:
    knee = session.track.model.body("left_knee_link").id
    start = session.track.moments[0]
    assert start.reference[knee] == pytest.approx(start.bodies[knee], abs=1e-6)
    session.pull["robot"] = np.array([0.0, 0.0, -250.0])
    run(session, 10)
    last = session.track.moments[-1]
    assert np.abs(last.reference[knee, :3] - last.bodies[knee, :3]).max() > 0.005


def test_the_figures_tell_who_carries_and_how_far_off_it_is(session: Session) -> None:
    run(session, 70)
    moments = [*session.track.moments]
    means, _ = session.track.readings(len(moments) - 1)
    off = [abs(moment.signals["pelvis_height"] - moment.signals["height_command"]) for moment in moments]
    assert means["E_h"] == pytest.approx(np.mean(off))
    borne = [-sum(force.force[2] for force in moment.forces if force.kind == "grip") for moment in moments[50:]]
    assert means["weight_in_hands"] == pytest.approx(np.mean(borne) / session.track.held_weight, rel=0.05)
    assert np.isnan(session.track.readings(10)[0]["weight_in_hands"])


def test_shapes_are_those_of_the_model(session: Session) -> None:
    model = session.track.model
    box = next(shape for shape in looks(model) if shape.body == "object")
    assert np.ptp(box.vertices, axis=0) == pytest.approx(2.0 * model.geom("object").size)
    for shape in collision_shapes(model):
        body = model.body(shape.body).id
        geoms = np.flatnonzero((model.geom_bodyid == body) & (model.geom_type != mujoco.mjtGeom.mjGEOM_MESH.value))
        reach = max(np.linalg.norm(model.geom_pos[geom]) + model.geom_rbound[geom] for geom in geoms)
        assert np.linalg.norm(shape.vertices, axis=1).max() <= reach + 1e-6
        assert shape.faces.max() < len(shape.vertices)
