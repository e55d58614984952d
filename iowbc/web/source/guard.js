/** What is passed on to the motors: targets that are numbers, and that a joint could have followed. */

/** Largest change of a target, as a multiple of the joint's velocity limit times the elapsed time: JUMP of the guard in Python. */
const JUMP = 2;

export class Guard {
  /** `limits`: the joints' velocity limits [rad/s]; `period`: control period [s]. */
  constructor(limits, period) {
    this.reach = limits.map((limit) => JUMP * limit * period);
    this.start();
  }

  /** The robot begins anew: it has no last targets. */
  start() {
    this.last = null;
    this.steps = 0;
  }

  /**
   * Targets to follow [rad], and whether the last good ones are held; at first the measured `position` stands for them.
   * While targets are held, the way that counts as a jump grows with the time, so that they are not held for good.
   */
  passed(targets, position) {
    const first = this.last === null, last = this.last ?? [...position];
    const jumps = targets.some((target, i) => Math.abs(target - last[i]) > this.reach[i] * (1 + this.steps));
    const held = !targets.every(Number.isFinite) || (!first && jumps);
    this.steps = held ? this.steps + 1 : 0;
    this.last = held ? last : targets;
    return { position: [...this.last], held };
  }
}
