"use strict";
// Bonded bodies by the laws of taichi_dem: step/explicit.py, step/bond.py and what they call.

class Solid extends SolvedDashpots {
  // points [m], tetrahedra: of a mesh; material: by the names of taichi_dem.Material.
  // held: bodies that are fixed; dt [s]; effects: which laws act; sleep: share of the mean speed
  // below which neighbours sleep; theta: 0 for explicit dashpots, else where in the step they act.
  constructor(points, tetrahedra, material, options) {
    super();
    const { dt, held = [], sleep = 0, theta = 0, tolerance = 0.05, sweeps = [2, 20], refresh = 3e-5 } = options;
    this.effects = { damping: true, softening: true, slip: true, contact: true, friction: true, ...options.effects };
    Object.assign(this, { points, tetrahedra, material, dt, sleep, theta, tolerance, sweeps });
    this.refreshEvery = Math.max(1, Math.round(refresh / dt));
    this.count = tetrahedra.length / 4;
    this.addBodies(held);
    this.addBonds();
    if (theta) this.addSolved();
    this.reset();
  }

  reset() {
    const m = this.material;
    this.x.set(this.centre);
    for (const name of ["v", "L", "w", "S", "T", "slipped", "strain", "moved", "awake", "broken", "acted", "q", "R"]) this[name].fill(0);
    for (let i = 0; i < this.count; i++) {
      this.q[4 * i] = 1;
      for (const k of [0, 4, 8]) this.R[9 * i + k] = 1;
    }
    this.limit.fill(m.tensile_strength / m.normal_stiffness);
    this.bodyActed = new Uint8Array(this.count);
    this.bound = this.steps = this.brokenCount = this.room = 0;
    this.exposed = [];
    this.near = [];
    this.heat = { dashpots: 0, friction: 0, cracks: 0 };
    this.given = this.drag = this.pressed = 0;
    this.started = false;
    if (!this.sleep) this.awake.fill(2);
  }

  // Add velocities [m/s] (3 a body): at the start, or as another blow.
  strike(velocity) {
    let size = 0, mass = 0, given = 0;
    for (let i = 0; i < this.count; i++) {
      const more = row(velocity, i);
      mass += this.mass[i];
      if (this.held[i] || !dot(more, more)) continue;
      given += this.mass[i] * (dot(more, row(this.v, i)) + 0.5 * dot(more, more));
      for (let k = 0; k < 3; k++) this.v[3 * i + k] += more[k];
      size += this.mass[i] * Math.sqrt(dot(more, more));
      if (this.sleep) this.stir(i);
    }
    this.given += given;
    this.bound = (this.sleep * size) / mass;
    if (!this.started) this.start();
  }

  // Bonds act once; velocities, which are those of time zero, are set half a step back.
  start() {
    this.started = true;
    if (this.theta) for (let b = 0; b < this.bonds; b++) this.firstTwist(b);
    this.S.fill(0);
    this.T.fill(0);
    for (let b = 0; b < this.bonds; b++) this.bond(b);
    // The account opens half a step after explicit dashpots are booked, and half one before solved ones.
    this.heat.dashpots = -this.late() * this.drag;
    for (let i = 0; i < this.count; i++) {
      if (this.held[i]) continue;
      for (let k = 3 * i; k < 3 * i + 3; k++) {
        this.v[k] -= (0.5 * this.S[k]) / this.mass[i];
        this.L[k] -= 0.5 * this.T[k];
      }
      this.findSpin(i, this.L, 3 * i, this.w, 3 * i);
    }
  }

  step() {
    this.pressed = 0;
    if (this.effects.contact) this.contacts();
    this.steps++;
    if (this.theta) this.solve();
    else for (let i = 0; i < this.count; i++) if (this.awake[i]) this.move(i);
    this.S.fill(0);
    this.T.fill(0);
    this.drag = 0;
    for (let b = 0; b < this.bonds; b++) this.bond(b);
    this.heat.dashpots += this.drag;
  }

  move(i) {
    const o = 3 * i, { v, L, S, T } = this;
    for (let k = o; k < o + 3; k++) {
      v[k] = this.held[i] ? 0 : v[k] + S[k] / this.mass[i];
      L[k] = this.held[i] ? 0 : L[k] + T[k];
    }
    this.findSpin(i, L, o, this.w, o);
    this.drift(i);
    if (this.sleep) this.notice(i);
  }

  // A body wakes its neighbours once its speed or its way is more than a share of what counts.
  notice(i) {
    const speed = size3(this.v, 3 * i);
    this.moved[i] += this.dt * speed;
    const far = this.moved[i] > (this.sleep * this.material.tensile_strength) / this.material.normal_stiffness;
    if (this.awake[i] === 1 && (speed > this.bound || far)) this.stir(i);
  }

  stir(i) {
    this.awake[i] = 2;
    for (let f = 4 * i; f < 4 * i + 4; f++) {
      const b = this.bondOf[f];
      if (b < 0) continue;
      for (const face of [this.faces[2 * b], this.faces[2 * b + 1]]) if (!this.awake[face >> 2]) this.awake[face >> 2] = 1;
    }
  }

  // Impulse of a bond on both bodies, or its release where a unit fails (step/bond.py).
  bond(b) {
    const i = this.faces[2 * b] >> 2, j = this.faces[2 * b + 1] >> 2;
    if (this.broken[b] || !this.awake[i] || !this.awake[j]) return;
    const { x, v, w, R, dt, material: m, effects, onSlave, onMaster, slipped, theta } = this, n = 3 * i, p = 3 * j;
    const axes = axes9, turn = turn9, offset = offset3, moved = moved6, motion = motion6;
    this.findAxes(b, 9 * i, 9 * j);
    const d0 = x[p] - x[n], d1 = x[p + 1] - x[n + 1], d2 = x[p + 2] - x[n + 2];
    const u0 = v[p] - v[n] - (w[n + 1] * d2 - w[n + 2] * d1), u1 = v[p + 1] - v[n + 1] - (w[n + 2] * d0 - w[n] * d2);
    const u2 = v[p + 2] - v[n + 2] - (w[n] * d1 - w[n + 1] * d0);
    const s0 = w[p] - w[n], s1 = w[p + 1] - w[n + 1], s2 = w[p + 2] - w[n + 2];
    for (let r = 0; r < 3; r++) {
      const a = axes[3 * r], e = axes[3 * r + 1], c = axes[3 * r + 2];
      offset[r] = a * d0 + e * d1 + c * d2;
      moved[r] = motion[r] = a * u0 + e * u1 + c * u2;
      moved[3 + r] = motion[3 + r] = a * s0 + e * s1 + c * s2;
      if (theta) this.answered(b, r, a, e, c);
    }
    const kn = m.normal_stiffness, ks = m.shear_stiffness, cn = m.normal_damping, cs = m.shear_damping;
    let f0 = 0, f1 = 0, f2 = 0, m0 = 0, m1 = 0, m2 = 0, dragged = 0, worked = 0, rubbed = 0, stored = 0, failed = false;
    for (let k = 0; k < 3; k++) {
      const at = 9 * b + 3 * k, sx = onSlave[at], sy = onSlave[at + 1], sz = onSlave[at + 2];
      const a0 = turn[0] * sx + turn[1] * sy + turn[2] * sz, a1 = turn[3] * sx + turn[4] * sy + turn[5] * sz;
      const a2 = turn[6] * sx + turn[7] * sy + turn[8] * sz;
      const open = offset[0] + a0 - onMaster[at];
      let y = offset[1] + a1 - onMaster[at + 1], z = offset[2] + a2 - onMaster[at + 2];
      let t0 = kn * open;
      if (effects.softening && open > 0) {
        t0 = this.soften(3 * b + k, open);
        failed = failed || this.limit[3 * b + k] >= failureOpening(m);
      }
      const w0 = dt * (moved[0] + moved[4] * a2 - moved[5] * a1), w1 = dt * (moved[1] + moved[5] * a0 - moved[3] * a2);
      const w2 = dt * (moved[2] + moved[3] * a1 - moved[4] * a0);
      if (effects.slip) {
        const u = 6 * b + 2 * k;
        y -= slipped[u];
        z -= slipped[u + 1];
        const reach2 = y * y + z * z, most = Math.max(0, m.cohesion - m.friction * t0);
        if (ks * ks * reach2 > most * most) {
          const reach = Math.sqrt(reach2), share = (reach - most / ks) / reach, gy = y * share, gz = z * share;
          rubbed += ks * ((y - 0.5 * gy) * gy + (z - 0.5 * gz) * gz) - 0.5 * ks * (w1 * gy + w2 * gz);
          slipped[u] += gy;
          slipped[u + 1] += gz;
          y -= gy;
          z -= gz;
          this.acted[b] |= 2;
        }
      }
      let t1 = ks * y, t2 = ks * z;
      stored += 0.5 * (t0 * open + t1 * y + t2 * z);
      worked += t0 * w0 + t1 * w1 + t2 * w2;
      if (effects.damping) {
        const v0 = motion[0] + motion[4] * a2 - motion[5] * a1, v1 = motion[1] + motion[5] * a0 - motion[3] * a2;
        const v2 = motion[2] + motion[3] * a1 - motion[4] * a0;
        dragged += cn * v0 * v0 + cs * (v1 * v1 + v2 * v2);
        t0 += cn * v0;
        t1 += cs * v1;
        t2 += cs * v2;
      }
      f0 += t0;
      f1 += t1;
      f2 += t2;
      m0 += a1 * t2 - a2 * t1;
      m1 += a2 * t0 - a0 * t2;
      m2 += a0 * t1 - a1 * t0;
    }
    const area = this.area[b];
    this.drag += area * dt * dragged;
    this.strain[b] = area * stored;
    this.heat.friction += area * rubbed;
    if (failed) return this.release(b, area * (stored - 0.5 * worked));
    this.pull(n, p, area * dt, f0, f1, f2, m0, m1, m2, d0, d1, d2);
    if (this.theta) this.beginSolve(b, i, j, [d0, d1, d2]);
  }

  // Axes of a bond in the world, and the turn from the slave's frame to them.
  findAxes(b, i, j) {
    const { R, frame } = this, axes = axes9, turn = turn9;
    for (let r = 0; r < 9; r += 3) {
      const f0 = frame[9 * b + r], f1 = frame[9 * b + r + 1], f2 = frame[9 * b + r + 2];
      const a = f0 * R[i] + f1 * R[i + 1] + f2 * R[i + 2], e = f0 * R[i + 3] + f1 * R[i + 4] + f2 * R[i + 5];
      const c = f0 * R[i + 6] + f1 * R[i + 7] + f2 * R[i + 8];
      axes[r] = a;
      axes[r + 1] = e;
      axes[r + 2] = c;
      turn[r] = a * R[j] + e * R[j + 3] + c * R[j + 6];
      turn[r + 1] = a * R[j + 1] + e * R[j + 4] + c * R[j + 7];
      turn[r + 2] = a * R[j + 2] + e * R[j + 5] + c * R[j + 8];
    }
  }

  // Traction at an opening [m] of a unit, which raises its elastic limit beyond it.
  soften(u, open) {
    const m = this.material, onset = m.tensile_strength / m.normal_stiffness, limit = this.limit;
    if (open > limit[u]) {
      limit[u] = open;
      this.acted[(u / 3) | 0] |= 1;
    }
    return limit[u] > onset ? (softened(m, limit[u]) / limit[u]) * open : m.normal_stiffness * open;
  }

  pull(n, p, scale, f0, f1, f2, m0, m1, m2, d0, d1, d2) {
    const axes = axes9, { S, T } = this, lin = lin3, ang = ang3;
    for (let k = 0; k < 3; k++) {
      lin[k] = scale * (axes[k] * f0 + axes[3 + k] * f1 + axes[6 + k] * f2);
      ang[k] = scale * (axes[k] * m0 + axes[3 + k] * m1 + axes[6 + k] * m2);
      S[n + k] += lin[k];
      S[p + k] -= lin[k];
      T[n + k] += ang[k];
      T[p + k] -= ang[k];
    }
    T[n] += d1 * lin[2] - d2 * lin[1];
    T[n + 1] += d2 * lin[0] - d0 * lin[2];
    T[n + 2] += d0 * lin[1] - d1 * lin[0];
  }

  release(b, freed) {
    this.broken[b] = 1;
    this.strain[b] = 0;
    this.brokenCount++;
    this.heat.cracks += freed;
    this.exposed.push(this.faces[2 * b], this.faces[2 * b + 1]);
    this.room = -1;
    if (this.theta) this.solved[b] = null;
  }

  // Where the energy given [J] is now: of motion, in springs, and taken by each kind of effect.
  energy() {
    const found = { motion: 0, springs: this.pressed, ...this.heat }, { v, L, S, T, mass, material: m } = this, late = [0, 0, 0, 0, 0, 0];
    for (let i = 0; i < this.count; i++) {
      for (let k = 0; k < 3; k++) {
        late[k] = this.held[i] ? 0 : v[3 * i + k] + (0.5 * S[3 * i + k]) / mass[i];
        late[3 + k] = this.held[i] ? 0 : L[3 * i + k] + 0.5 * T[3 * i + k];
      }
      this.findSpin(i, late, 3, ang3, 0);
      found.motion += 0.5 * (mass[i] * dot(late, late) + late[3] * ang3[0] + late[4] * ang3[1] + late[5] * ang3[2]);
    }
    const onset = m.tensile_strength / m.normal_stiffness, end = failureOpening(m);
    for (let b = 0; b < this.bonds; b++) {
      found.springs += this.strain[b];
      for (let u = 3 * b; u < 3 * b + 3; u++) {
        const at = Math.min(this.limit[u], end);
        if (at > onset) found.cracks += 0.5 * this.area[b] * (m.tensile_strength * at - softened(m, at) * onset);
      }
    }
    // Explicit dashpots are booked ahead of their step, solved ones a step late.
    found.dashpots += this.late() * this.drag;
    return found;
  }

  late() {
    return this.theta ? 0.5 : -0.5;
  }
}

const failureOpening = (m) => (2 * m.fracture_energy) / m.tensile_strength;

// Traction at an opening beyond the onset (physics/fracture.py).
function softened(m, open) {
  const onset = m.tensile_strength / m.normal_stiffness, end = failureOpening(m);
  return Math.max(0, (m.tensile_strength * (end - open)) / (end - onset));
}
