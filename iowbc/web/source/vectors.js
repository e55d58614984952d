/** Vectors of three, matrices of 3 × 3 row by row, and quaternions wxyz, as plain arrays. */

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a) => Math.sqrt(dot(a, a));
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

/** The transposed matrix times a vector: back into the frame that a rotation came from. */
export const applyInverse = (m, v) => [0, 1, 2].map((i) => m[i] * v[0] + m[3 + i] * v[1] + m[6 + i] * v[2]);

/** The conjugate of quaternion `a` times quaternion `b`, with a positive scalar part: b as seen from a. */
export function relative(a, b) {
  const [w, x, y, z] = a;
  const found = [
    w * b[0] + x * b[1] + y * b[2] + z * b[3],
    w * b[1] - x * b[0] - y * b[3] + z * b[2],
    w * b[2] + x * b[3] - y * b[0] - z * b[1],
    w * b[3] - x * b[2] + y * b[1] - z * b[0],
  ];
  return found[0] < 0 ? found.map((part) => -part) : found;
}

export const clip = (value, low, high) => Math.min(Math.max(value, low), high);
