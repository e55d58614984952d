/** What the motors can give: their torque limits, less at speed, and what two joints of one linkage share. */

import { clip } from "./vectors.js";

/**
 * Least and greatest torque of each motor over the period to come, one pair after the other [N·m]. `drives` of a scene:
 * effort [N·m], speed [rad/s] at which there is no torque left, the part of it up to which there is all (corner), kp, kd
 * and linkages, whose joints a, b are moved by two motors together: |τ_a| + |τ_b| ≤ effort.
 */
export function torqueRanges(drives, target, position, velocity) {
  const { kp, kd, speed, corner } = drives, effort = [...drives.effort];
  for (const pair of drives.linkages) {
    const wanted = pair.map((i) => Math.abs(kp[i] * (target[i] - position[i]) - kd[i] * velocity[i]));
    const scale = Math.min(1, drives.effort[pair[0]] / Math.max(wanted[0] + wanted[1], 1e-9));
    pair.forEach((joint, i) => (effort[joint] = drives.effort[joint] - scale * wanted[1 - i]));
  }
  return effort.flatMap((most, i) => {
    const reserve = velocity[i] / ((1 - corner) * speed[i]), atRest = 1 / (1 - corner);
    return [-most * clip(atRest + reserve, 0, 1), most * clip(atRest - reserve, 0, 1)];
  });
}
