/** The gait clock φ_t: when it runs. */

const TINY = 1e-9;

/** Whether the commanded velocity asks for steps; `gait` as in the contract's references. */
export function wantsToMove(command, gait) {
  return Math.hypot(command[0], command[1]) > gait.moving_speed || Math.abs(command[2]) > gait.moving_yaw_rate;
}

/**
 * One control step of the clock, {phase, stepping}. It starts when the command asks for motion; when the command stops,
 * it runs on to the next moment at which both feet are down, phase 0 or 0.5, and rests there.
 */
export function advance({ phase, stepping }, moving, gait, dt) {
  const halves = Math.floor(phase * 2 + TINY);
  const advanced = phase + gait.frequency * dt;
  const arrived = Math.floor(advanced * 2 + TINY) > halves;
  const rests = !moving && (!stepping || arrived);
  const kept = stepping && arrived ? (halves + 1) * 0.5 : phase;
  return { phase: (rests ? kept : advanced) % 1, stepping: !rests };
}
