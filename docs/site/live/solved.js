"use strict";
// Dashpots of bonds that are solved together in a step (step/solved.py, step/implicit).

class SolvedDashpots extends TouchingBodies {
  addSolved() {
    this.solved = new Array(this.bonds).fill(null);
    this.twist = new Float64Array(6 * this.count);
    for (const name of ["begun", "last"]) this[name] = new Float64Array(6 * this.bonds);
    this.branch = new Float64Array(3 * this.bonds);
  }

  // Twist of a bond now, slave against master at the slave's centre.
  twistOf(i, j, d) {
    const spin = row(this.w, i), turned = cross(spin, d);
    return [...minus(minus(row(this.v, j), row(this.v, i)), turned), ...minus(row(this.w, j), spin)];
  }

  firstTwist(b) {
    const i = this.faces[2 * b] >> 2, j = this.faces[2 * b + 1] >> 2;
    const now = this.twistOf(i, j, minus(row(this.x, j), row(this.x, i)));
    this.begun.set(now, 6 * b);
    this.last.set(now, 6 * b);
  }

  // Component r of the twist that the dashpots of a bond answered, in its axes.
  answered(b, r, a, e, c) {
    const o = 6 * b, share = 1 - this.theta, { last, begun, theta } = this;
    const at = (k) => theta * last[o + k] + share * begun[o + k];
    motion6[r] = a * at(0) + e * at(1) + c * at(2);
    motion6[3 + r] = a * at(3) + e * at(4) + c * at(5);
  }

  beginSolve(b, i, j, d) {
    const now = this.twistOf(i, j, d), ratio = (1 - this.theta) / this.theta;
    this.branch.set(d, 3 * b);
    for (let k = 0; k < 6; k++) {
      this.last[6 * b + k] += ratio * (this.begun[6 * b + k] - now[k]);
      this.begun[6 * b + k] = now[k];
    }
    if (this.steps % this.refreshEvery === 0) this.solved[b] = Float64Array.from(this.block(b, i, j, d).flat());
  }

  // (C^-1 + G)^-1: impulse per missing twist, with the law C of a bond and the mobility G of its pair.
  block(b, i, j, d) {
    const m = this.material, Ri = matrix(this.R, i), Rj = matrix(this.R, j), axes = product(matrix(this.frame, b), transposed(Ri));
    const normal = m.normal_damping + 1e-9 * this.dt * m.normal_stiffness, shear = m.shear_damping + 1e-9 * this.dt * m.shear_stiffness;
    const scale = this.theta * this.dt * this.area[b], rates = [scale * normal, scale * shear, scale * shear];
    const law = product(transposed(axes), axes.map((r, k) => times(r, rates[k])));
    let damped = null;
    for (let k = 0; k < 3; k++) {
      const arm = skew(along(Rj, row(this.onSlave, 3 * b + k))), lever = product(law, arm);
      const one = six(law, lever.map((r) => times(r, -1)), product(transposed(arm), lever));
      damped = damped ? plus(damped, one) : one;
    }
    const turnI = this.turnOf(i), turnJ = this.turnOf(j), across = skew(d), lever = product(across, turnI);
    const light = 1 / this.mass[i] + 1 / this.mass[j];
    const straight = product(lever, across).map((r, k) => r.map((value, c) => (c === k ? light : 0) - value));
    const mobility = six(straight, lever.map((r) => times(r, -1)), plus(turnI, turnJ));
    return inverse(plus(inverse(damped), mobility));
  }

  // World inverse inertia of a body.
  turnOf(i) {
    const R = matrix(this.R, i);
    return product(product(R, matrix(this.light, i)), transposed(R));
  }

  // Velocities are predicted; sweeps over all dashpots correct them until none changes further.
  solve() {
    const { twist, v, w, S, mass, dt } = this;
    let speed2 = 0;
    for (let i = 0; i < this.count; i++) {
      this.findSpin(i, this.T, 3 * i, ang3, 0);
      for (let k = 0; k < 3; k++) {
        twist[6 * i + k] = v[3 * i + k] + S[3 * i + k] / mass[i];
        twist[6 * i + 3 + k] = w[3 * i + k] + ang3[k];
      }
      speed2 = Math.max(speed2, v[3 * i] ** 2 + v[3 * i + 1] ** 2 + v[3 * i + 2] ** 2);
    }
    for (let sweep = 1; ; sweep++) {
      let change2 = 0;
      if (this.effects.damping) for (let b = 0; b < this.bonds; b++) if (this.solved[b]) change2 = Math.max(change2, this.visit(b));
      const settled = sweep >= this.sweeps[0] && change2 <= this.tolerance ** 2 * speed2;
      if (settled || sweep >= this.sweeps[1]) break;
    }
    for (let i = 0; i < this.count; i++) this.moveSolved(i);
  }

  visit(b) {
    const i = this.faces[2 * b] >> 2, j = this.faces[2 * b + 1] >> 2, { twist: y, last, branch } = this, n = 6 * i, p = 6 * j;
    const block = this.solved[b], miss = moved6, push = motion6, o = 6 * b, d = 3 * b;
    const d0 = branch[d], d1 = branch[d + 1], d2 = branch[d + 2];
    twistBetween(y, n, p, d0, d1, d2, miss);
    for (let k = 0; k < 6; k++) miss[k] -= last[o + k];
    const change2 = miss[0] * miss[0] + miss[1] * miss[1] + miss[2] * miss[2];
    for (let k = 0; k < 6; k++) {
      let sum = 0;
      for (let c = 0; c < 6; c++) sum += block[6 * k + c] * miss[c];
      push[k] = sum;
    }
    this.push(i, n, 1, push, push[3] + d1 * push[2] - d2 * push[1], push[4] + d2 * push[0] - d0 * push[2], push[5] + d0 * push[1] - d1 * push[0]);
    this.push(j, p, -1, push, push[3], push[4], push[5]);
    twistBetween(y, n, p, d0, d1, d2, miss);
    for (let k = 0; k < 6; k++) last[o + k] = miss[k];
    return change2;
  }

  push(i, n, sign, force, mx, my, mz) {
    lin3[0] = mx;
    lin3[1] = my;
    lin3[2] = mz;
    this.findSpin(i, lin3, 0, ang3, 0);
    for (let k = 0; k < 3; k++) {
      this.twist[n + k] += (sign * force[k]) / this.mass[i];
      this.twist[n + 3 + k] += sign * ang3[k];
    }
  }

  moveSolved(i) {
    const R = matrix(this.R, i), gain = [0, 1, 2].map((k) => this.twist[6 * i + 3 + k] - this.w[3 * i + k]);
    const momentum = along(R, along(matrix(this.inertia, i), along(transposed(R), gain)));
    for (let k = 0; k < 3; k++) {
      this.v[3 * i + k] = this.twist[6 * i + k];
      this.L[3 * i + k] += momentum[k];
    }
    this.findSpin(i, this.L, 3 * i, this.w, 3 * i);
    this.drift(i);
    this.findSpin(i, this.L, 3 * i, this.w, 3 * i);
  }
}

// Twist of the body at row p of y against that at row n, with its centre at d from the other's.
function twistBetween(y, n, p, d0, d1, d2, out) {
  out[0] = y[p] - y[n] - (y[n + 4] * d2 - y[n + 5] * d1);
  out[1] = y[p + 1] - y[n + 1] - (y[n + 5] * d0 - y[n + 3] * d2);
  out[2] = y[p + 2] - y[n + 2] - (y[n + 3] * d1 - y[n + 4] * d0);
  for (let k = 3; k < 6; k++) out[k] = y[p + k] - y[n + k];
}
