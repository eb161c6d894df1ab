"use strict";
// Vectors and matrices of three, and symmetric ones of six, as arrays; scratch for inner loops.
// Numbers of a body or bond lie in a row of a typed array: 3 of a vector, 9 of a matrix by rows.

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const unit = (a) => times(a, 1 / Math.sqrt(dot(a, a)));
const row = (array, i) => [array[3 * i], array[3 * i + 1], array[3 * i + 2]];
const matrix = (array, i) => [0, 1, 2].map((r) => row(array, 3 * i + r));
const product = (a, b) => a.map((r) => [0, 1, 2].map((c) => r[0] * b[0][c] + r[1] * b[1][c] + r[2] * b[2][c]));
const transposed = (a) => a[0].map((_, c) => a.map((r) => r[c]));
const along = (m, v) => m.map((r) => dot(r, v));
const skew = (r) => [[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]];

// Inverse of a positive definite matrix (Gauss and Jordan).
function inverse(given) {
  const n = given.length, m = given.map((r, i) => [...r, ...given.map((_, c) => (c === i ? 1 : 0))]);
  for (let k = 0; k < n; k++) {
    const pivot = 1 / m[k][k];
    for (let c = 0; c < 2 * n; c++) m[k][c] *= pivot;
    for (let r = 0; r < n; r++) {
      const share = r === k ? 0 : m[r][k];
      if (share) for (let c = 0; c < 2 * n; c++) m[r][c] -= share * m[k][c];
    }
  }
  return m.map((r) => r.slice(n));
}

// Blocks of a symmetric 6x6 matrix: [[a, b], [b^T, c]] (physics/wrench.py).
const six = (a, b, c) => [...a.map((r, i) => [...r, ...b[i]]), ...c.map((r, i) => [...transposed(b)[i], ...r])];
const plus = (a, b) => a.map((r, i) => r.map((x, k) => x + b[i][k]));

const [axes9, turn9] = [new Float64Array(9), new Float64Array(9)];
const [moved6, motion6] = [new Float64Array(6), new Float64Array(6)];
const [offset3, ahead3, turning, lin3, ang3, first3, second3] = Array.from({ length: 7 }, () => new Float64Array(3));

// Length of the vector at a place of an array.
const size3 = (a, o) => Math.sqrt(a[o] * a[o] + a[o + 1] * a[o + 1] + a[o + 2] * a[o + 2]);
