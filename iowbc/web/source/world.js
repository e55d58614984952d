/** MuJoCo's simulation of one scene: the model that the policy was trained in, at its nominal values. */

import { torqueRanges } from "./drives.js";
import { Hold } from "./hold.js";
import * as v from "./vectors.js";

const BASE = { position: [0, 3], quaternion: [3, 7], linear: [0, 3], angular: [3, 6] };
const FULL_TURN = 2 * Math.PI;

export class World {
  /** `mujoco`: the module; `scene`: what the page's scenes.json says of it. `delete` it when it is no longer needed. */
  constructor(mujoco, scene) {
    this.mujoco = mujoco;
    this.scene = scene;
    this.model = mujoco.MjModel.from_xml_string(scene.xml);
    this.data = new mujoco.MjData(this.model);
    this.scratch = new mujoco.MjData(this.model);
    for (const [name, values] of Object.entries(scene.fields)) this.#write(name, values);
    mujoco.mj_setConst(this.model, this.scratch);
    this.hold = scene.hold && new Hold(this);
    this.mass = scene.object?.mass ?? 0;
    this.reset();
  }

  /** MJCF has six digits of each number; these have all. */
  #write(name, values) {
    const field = this.model[name];
    if (field?.length !== values.length) {
      throw new Error(`${name}: MuJoCo has ${field?.length} numbers, the page ${values.length}: another version of MuJoCo`);
    }
    field.set(values);
  }

  /** The robot in its first posture on its soles, with the object in its hands. */
  reset() {
    const { joints, start } = this.scene;
    this.mujoco.mj_resetData(this.model, this.data);
    this.data.qpos.set(start);
    this.data.ctrl.set(start.slice(...joints.position));
    this.hold?.reset();
    this.heading = 0;
    this.mujoco.mj_forward(this.model, this.data);
  }

  /** Time since the reset [s]. */
  get time() {
    return this.data.time;
  }

  /** What the object weighs [kg]; a light one has more inertia. */
  set mass(mass) {
    const { object } = this.scene;
    if (!object) return;
    this.weighed = mass;
    const inertia = Math.max(mass, object.least_inertia);
    this.model.body_mass[object.body] = inertia;
    this.model.body_inertia.set(object.inertia_per_mass.map((value) => value * inertia), 3 * object.body);
    this.mujoco.mj_setConst(this.model, this.scratch);
    this.mujoco.mj_forward(this.model, this.data);
  }

  get mass() {
    return this.weighed ?? 0;
  }

  /** What the robot's sensors deliver, without noise and delay, by the names of the contract's inputs. */
  measured() {
    const { qpos, qvel } = this.data, { base, joints, object } = this.scene;
    const rotation = this.rotation(base), turning = Array.from(qvel.slice(...BASE.angular));
    const turned = (Math.atan2(rotation[3], rotation[0]) - this.heading + Math.PI) % FULL_TURN;
    this.heading += (turned < 0 ? turned + FULL_TURN : turned) - Math.PI;
    const robot = {
      projected_gravity: rotation.slice(6, 9).map((value) => -value),
      base_angular_velocity: turning,
      heading: [this.heading],
      joint_position: Array.from(qpos.slice(...joints.position)),
      joint_velocity: Array.from(qvel.slice(...joints.velocity)),
    };
    return object ? { ...robot, ...this.#seen(rotation, turning, object.body) } : robot;
  }

  /** The object as the base sees it. */
  #seen(rotation, turning, body) {
    const { qpos, qvel } = this.data;
    const place = v.applyInverse(rotation, v.subtract(this.position(body), qpos.slice(...BASE.position)));
    const { linear, angular } = this.velocity(body);
    const velocity = v.applyInverse(rotation, v.subtract(linear, qvel.slice(...BASE.linear)));
    return {
      object_position: place,
      object_quaternion: v.relative(qpos.slice(...BASE.quaternion), this.quaternion(body)),
      object_linear_velocity: v.subtract(velocity, v.cross(turning, place)),
      object_angular_velocity: v.subtract(v.applyInverse(rotation, angular), turning),
    };
  }

  position(body) {
    return Array.from(this.data.xpos.slice(3 * body, 3 * body + 3));
  }

  quaternion(body) {
    return Array.from(this.data.xquat.slice(4 * body, 4 * body + 4));
  }

  rotation(body) {
    return Array.from(this.data.xmat.slice(9 * body, 9 * body + 9));
  }

  /** Of a body's origin, world frame [m/s, rad/s]. */
  velocity(body) {
    const spatial = this.data.cvel.slice(6 * body, 6 * body + 6), root = 3 * this.model.body_rootid[body];
    const angular = Array.from(spatial.slice(0, 3));
    const arm = v.subtract(this.position(body), this.data.subtree_com.slice(root, root + 3));
    return { angular, linear: v.add(spatial.slice(3), v.cross(angular, arm)) };
  }

  /** One control period with joint targets [rad], which the motors follow by the contract's PD law. */
  step(target) {
    const { mujoco, model, data, hold } = this, { drives, joints } = this.scene;
    const [position, velocity] = [data.qpos.slice(...joints.position), data.qvel.slice(...joints.velocity)];
    model.actuator_forcerange.set(torqueRanges(drives, target, position, velocity));
    data.ctrl.set(target);
    hold?.act();
    for (let i = 0; i < this.scene.substeps; i += 1) {
      mujoco.mj_step2(model, data);
      hold?.feel();
      mujoco.mj_step1(model, data);
    }
    hold?.settle();
  }

  delete() {
    for (const each of [this.scratch, this.data, this.model]) each.delete();
  }
}
