/** How hands hold an object, beside their connection or contact: squeeze, torsion of the palms, slip, and handing over. */

import * as v from "./vectors.js";

const GRAVITY = 9.81, TINY = 1e-9;
const three = (array, index) => Array.from(array.slice(3 * index, 3 * index + 3));

export class Hold {
  /** `world`: with the `hold` of its scene. */
  constructor(world) {
    this.world = world;
    this.settings = world.scene.hold;
    this.reset();
  }

  reset() {
    this.angle = this.rate = this.borne = this.felt = this.periods = 0;
    this.strongest = [0, 0];
    this.connected = [1, 1];
    this.#connect();
  }

  /** Lets those hands go that are no longer connected; the bindings show the flags in the state alone. */
  #connect() {
    if (!this.settings.compliant) return;
    const { mujoco, model, data } = this.world;
    mujoco.mj_setState(model, data, this.connected, mujoco.mjtState.mjSTATE_EQ_ACTIVE.value);
  }

  /** Forces of the period to come; changes the targets of the arms. */
  act() {
    const { data, scene } = this.world, { settings } = this;
    const object = scene.object.body, mass = this.world.mass, inertia = this.world.model.body_mass[object];
    data.xfrc_applied.fill(0);
    const left = Math.max(settings.handover - this.periods, 0) / Math.max(settings.handover, 1);
    data.xfrc_applied[6 * object + 2] = GRAVITY * (left * mass + inertia - mass);
    this.periods += 1;
    const force = settings.squeeze + Math.min((settings.by_friction * this.borne) / settings.friction, settings.strength);
    this.#press(force);
    if (settings.compliant) this.#twist(inertia, object);
    this.strongest = [0, 0];
  }

  /** Motors press the hands against each other with a force [N]: τ = Jᵀ f, target += τ / kp. */
  #press(force) {
    const { data, scene } = this.world, { settings } = this;
    const points = settings.points.map((place) => three(settings.compliant ? data.site_xpos : data.geom_xpos, place));
    points.forEach((point, side) => {
      const across = v.subtract(points[1 - side], point);
      const inward = v.scale(across, force / v.length(across));
      for (const { joint, hinge, kp } of settings.arms[side]) {
        const lever = v.subtract(point, three(data.xanchor, hinge));
        data.ctrl[joint] += v.dot(three(data.xaxis, hinge), v.cross(lever, inward)) / kp;
      }
      if (!settings.compliant) return;
      const wrist = scene.wrists[side];
      const about = v.cross(inward, v.subtract(point, three(data.xipos, wrist)));
      data.xfrc_applied.set([...v.scale(inward, -1), ...about], 6 * wrist);
    });
  }

  /** Palms resist turning of the object about the line between them, elastic, damped, and slipping. */
  #twist(mass, object) {
    const { data, scene } = this.world, { settings } = this, [left, right] = scene.hands;
    const between = v.subtract(...settings.points.map((place) => three(data.site_xpos, place)));
    const axis = v.scale(between, 1 / (v.length(between) + TINY));
    const turning = (body) => Array.from(data.cvel.slice(6 * body, 6 * body + 3));
    const hands = v.scale(v.add(turning(left), turning(right)), 0.5);
    const rate = v.dot(v.subtract(turning(object), hands), axis);
    this.angle += 0.5 * scene.period * (rate + this.rate);
    this.rate = rate;
    const inertia = settings.about * mass, stable = (settings.stability * inertia) / scene.period;
    const stiffness = Math.min(settings.stiffness, stable / scene.period);
    const most = settings.torsion * settings.slip_force * (this.connected[0] + this.connected[1]);
    const reach = most / Math.max(stiffness, TINY);
    this.angle = v.clip(this.angle, -reach, reach);
    const lag = 0.5 * scene.period * stiffness;
    const damping = Math.min(settings.swing_damping * inertia + lag, stable);
    const torque = v.scale(axis, -v.clip(stiffness * this.angle + damping * rate, -most, most));
    const add = (body, moment) => moment.forEach((value, i) => (data.xfrc_applied[6 * body + 3 + i] += value));
    add(object, torque);
    scene.hands.forEach((hand) => add(hand, v.scale(torque, -0.5)));
  }

  /** After each physics step: the strongest forces of the period. */
  feel() {
    const { sensordata } = this.world.data;
    this.settings.sensors.forEach((place, side) => {
      this.strongest[side] = Math.max(this.strongest[side], v.length(sensordata.slice(place, place + 3)));
    });
  }

  /** After a period: what the hands bear, and whether one has let go. */
  settle() {
    const { data, scene } = this.world;
    const loads = scene.hands.map((hand) => v.length(data.cfrc_ext.slice(6 * hand + 3, 6 * hand + 6)));
    this.borne = 0.5 * (loads[0] + loads[1]);
    if (!this.settings.compliant) return;
    const slips = this.connected.map((held, side) => held && this.strongest[side] > this.settings.slip_force);
    if (!slips.some(Boolean)) return;
    this.connected = this.connected.map((held, side) => (slips[side] ? 0 : held));
    this.#connect();
    this.world.mujoco.mj_step1(this.world.model, data);
  }
}
