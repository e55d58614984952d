/** Kinematics of both arms: forward, Jacobian, damped differential IK (paper eq. 2, 3), torques that bear weight. */

import * as v from "./vectors.js";

const Y = [0, 1, 0];
const GRAVITY = 9.81;

/**
 * Where the hinges of a chain are at some angles [rad], in the frame that the chain hangs on: of each its origin, axis
 * and the rotation of its body. `chain`: bodies outward, {position, rotation, axis or null, mass, moment}.
 */
export function place(chain, angles) {
  const hinges = [];
  let rotation = v.IDENTITY, origin = [0, 0, 0];
  for (const body of chain) {
    origin = v.add(origin, v.apply(rotation, body.position));
    rotation = v.multiply(rotation, body.rotation);
    if (body.axis === null) continue;
    const axis = v.apply(rotation, body.axis);
    rotation = v.multiply(rotation, v.turn(body.axis, angles[hinges.length]));
    hinges.push({ body, origin, axis, rotation });
  }
  return hinges;
}

export class Arms {
  /** `kinematics` {chains: [left, right], waist, grips} with all else from the contract. */
  constructor(kinematics, contract) {
    this.kinematics = kinematics;
    this.settings = contract.references.arms;
    const ofArms = (values) => contract.interaction.map((joint) => values[joint]);
    const own = this.settings.joint_speed ?? Infinity;
    this.rest = ofArms(contract.default_position);
    this.lower = ofArms(contract.lower);
    this.upper = ofArms(contract.upper);
    this.speed = ofArms(contract.velocity_limit).map((limit) => Math.min(limit, own));
    this.length = this.rest.length / 2;
  }

  /** Wrist [m] in the torso frame of one side, and its Jacobian, a column a joint. */
  forward(side, angles) {
    const hinges = place(this.kinematics.chains[side], angles);
    const last = hinges[hinges.length - 1];
    const wrist = v.add(last.origin, v.apply(last.rotation, this.kinematics.grips[side]));
    return { wrist, jacobian: hinges.map(({ axis, origin }) => v.cross(axis, v.subtract(wrist, origin))) };
  }

  /**
   * One step of differential IK towards wrist targets [left, right] in the torso frame [m], with the redundancy drawn to
   * the rest posture: next = q + J⁺e + (1 − J⁺J) k (rest − q) dt, J⁺ = Jᵀ(JJᵀ + λ² + ρ|e|)⁻¹; e is cut to its longest.
   */
  solveStep(arms, targets, dt) {
    return targets.flatMap((target, side) => {
      const from = side * this.length;
      return this.#sideStep(side, arms.slice(from, from + this.length), target, dt).map((value, i) => {
        const joint = from + i, bound = this.speed[joint] * dt;
        return v.clip(arms[joint] + v.clip(value, -bound, bound), this.lower[joint], this.upper[joint]);
      });
    });
  }

  #sideStep(side, angles, target, dt) {
    const { settings } = this, { wrist, jacobian } = this.forward(side, angles);
    const away = v.subtract(target, wrist), distance = v.length(away);
    const error = v.scale(away, settings.longest_step / Math.max(distance, settings.longest_step));
    const damping = settings.damping ** 2 + settings.reach * Math.min(distance, settings.longest_step);
    const gram = [0, 1, 2].flatMap((i) =>
      [0, 1, 2].map((j) => jacobian.reduce((sum, column) => sum + column[i] * column[j], i === j ? damping : 0)),
    );
    const gain = settings.posture_gain * dt;
    const posture = angles.map((angle, i) => gain * (this.rest[side * this.length + i] - angle));
    const moved = jacobian.reduce((sum, column, i) => v.add(sum, v.scale(column, posture[i])), [0, 0, 0]);
    const answer = v.solve(gram, v.subtract(error, moved));
    return jacobian.map((column, i) => posture[i] + v.dot(column, answer));
  }

  /** A point of the heading frame at the base [m], as the torso frame sees it; `waist` angles, `pitch` of the pelvis. */
  intoTorso(waist, pitch, point) {
    const inPelvis = v.applyInverse(v.turn(Y, pitch), point);
    const last = place(this.kinematics.waist, waist).at(-1);
    return last ? v.applyInverse(last.rotation, v.subtract(inPelvis, last.origin)) : inPelvis;
  }

  /**
   * Torques that hold the arms still with a load [kg] on each grip [N·m]; `down`: gravity's direction in the base frame.
   * That of hinge i is −(a_i × Σ_k m_k (c_k − o_i))·g over the links k from i outward.
   */
  gravityTorque(arms, waist, down, load) {
    const last = place(this.kinematics.waist, waist).at(-1);
    const pull = v.scale(last ? v.applyInverse(last.rotation, down) : down, GRAVITY);
    return [0, 1].flatMap((side) => {
      const from = side * this.length;
      const hinges = place(this.kinematics.chains[side], arms.slice(from, from + this.length));
      const { origin, rotation } = hinges[hinges.length - 1];
      let mass = load;
      let moment = v.scale(v.add(origin, v.apply(rotation, this.kinematics.grips[side])), load);
      const torques = [];
      for (const hinge of hinges.reverse()) {
        const own = v.add(v.scale(hinge.origin, hinge.body.mass), v.apply(hinge.rotation, hinge.body.moment));
        mass += hinge.body.mass;
        moment = v.add(moment, own);
        torques.unshift(-v.dot(v.cross(hinge.axis, v.subtract(moment, v.scale(hinge.origin, mass))), pull));
      }
      return torques;
    });
  }
}
