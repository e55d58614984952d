/** The 11-D command C: its rates, and the region of height and torso pitch that it is clamped to. */

import { clip } from "./vectors.js";

export const [VELOCITY_X, VELOCITY_Y, YAW_RATE, HEIGHT, PITCH, OFFSET] = [0, 1, 2, 3, 4, 5];

/** Largest change a second of each entry, (11,), from the contract's `commands.rates`. */
export function rateLimits(rates) {
  return [rates.velocity, rates.velocity, rates.yaw_rate, rates.height, rates.pitch, ...Array(6).fill(rates.offset)];
}

/** The command moved towards its goal by at most `largest` (11,). */
export function approach(command, goal, largest) {
  return command.map((value, i) => value + clip(goal[i] - value, -largest[i], largest[i]));
}

/** The command with pitch, then height at it, brought into the feasible map {pitch, low, high}, or as it is without. */
export function clamp(command, feasible) {
  if (!feasible) return command;
  const kept = [...command], { pitch, low, high } = feasible;
  kept[PITCH] = clip(command[PITCH], pitch[0], pitch[pitch.length - 1]);
  kept[HEIGHT] = clip(command[HEIGHT], interpolate(kept[PITCH], pitch, low), interpolate(kept[PITCH], pitch, high));
  return kept;
}

function interpolate(x, places, values) {
  if (x >= places[places.length - 1]) return values[values.length - 1];
  const above = Math.max(places.findIndex((place) => place > x), 1);
  const [left, right] = [places[above - 1], places[above]];
  return values[above - 1] + ((values[above] - values[above - 1]) / (right - left)) * (x - left);
}
