/** The reference layer: a command becomes arm references by IK and support references by the generator in the graph. */

import { Arms } from "./arms.js";
import { OFFSET, PITCH } from "./command.js";

export class References {
  /** `support(arms, command)`: θ_S_ref without the gait prior, from the graph [rad]. */
  constructor(contract, kinematics, support) {
    this.arms = new Arms(kinematics, contract);
    this.support = support;
    this.settings = contract.references;
    this.waist = kinematics.waist_joints;
    this.waistPitch = kinematics.waist_pitch;
    this.stiffness = contract.interaction.map((joint) => contract.kp[joint]);
  }

  /** References {arms, posture} settled in a commanded posture; `grasp`: the left wrist's base grasp [m]. */
  async start(command, grasp) {
    const { settling, settling_time, refining, refining_time } = this.settings.arms;
    let arms = this.arms.rest, posture = await this.support(arms, command);
    const targets = this.#wristTargets(posture, command, grasp);
    for (let i = 0; i < settling; i += 1) arms = this.arms.solveStep(arms, targets, settling_time);
    posture = await this.support(arms, command);
    for (let i = 0; i < refining; i += 1) {
      ({ arms, posture } = await this.advance({ arms, posture }, command, grasp, refining_time));
    }
    return { arms, posture };
  }

  /** References one control period later. */
  async advance({ arms, posture }, command, grasp, dt) {
    const moved = this.arms.solveStep(arms, this.#wristTargets(posture, command, grasp), dt);
    return { arms: moved, posture: await this.support(moved, command) };
  }

  /** Targets of the arms' motors [rad]: the references, and what bears the arms and a load [kg] between the hands. */
  armTarget({ arms, posture }, command, load) {
    if (!this.settings.arms.gravity) return arms;
    const pitch = this.#pelvisPitch(posture, command), down = [Math.sin(pitch), 0, -Math.cos(pitch)];
    const torque = this.arms.gravityTorque(arms, this.#waistOf(posture), down, 0.5 * load);
    return arms.map((angle, i) => angle + torque[i] / this.stiffness[i]);
  }

  #waistOf(posture) {
    return this.waist.map((joint) => posture[joint]);
  }

  /** Of the reference posture: the torso's less the waist's [rad]. */
  #pelvisPitch(posture, command) {
    return this.waistPitch.reduce((pitch, joint) => pitch - posture[joint], command[PITCH]);
  }

  /** x_wrist = x_task_base + Δp (eq. 2), ahead of the base grasp where the torso leans, in the torso frame [m]. */
  #wristTargets(posture, command, grasp) {
    const pitch = this.#pelvisPitch(posture, command), waist = this.#waistOf(posture);
    const ahead = this.settings.lean * Math.max(Math.sin(command[PITCH]), 0);
    return [1, -1].map((side, i) => {
      const offset = command.slice(OFFSET + 3 * i, OFFSET + 3 * i + 3);
      const wrist = [grasp[0] + offset[0] + ahead, side * grasp[1] + offset[1], grasp[2] + offset[2]];
      return this.arms.intoTorso(waist, pitch, wrist);
    });
  }
}
