"use strict";
// Bonded tetrahedra by the laws of taichi_dem: step/explicit.py, step/solved.py and what they call.
// Numbers of a body or bond lie in a row of a typed array: 3 of a vector, 9 of a matrix by rows.

// Corners of the four faces, outward (mesh/tetrahedra.py).
const FACES = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
// Inner crossings of a face whose edges are cut in five: the paper's six spheres (mesh/topology.py).
const CROSSINGS = [[1, 1, 3], [1, 2, 2], [1, 3, 1], [2, 1, 2], [2, 2, 1], [3, 1, 1]];
const SPHERES = CROSSINGS.length;

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

class Solid {
  // points [m], tetrahedra: of a mesh; material: by the names of taichi_dem.Material.
  // held: bodies that are fixed; dt [s]; effects: which laws act; sleep: share of the mean speed
  // below which neighbours sleep; theta: 0 for explicit dashpots, else where in the step they act.
  constructor(points, tetrahedra, material, options) {
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

  addBodies(held) {
    const n = this.count, numbers = (k) => new Float64Array(k * n);
    for (const name of ["centre", "x", "v", "L", "w", "S", "T"]) this[name] = numbers(3);
    for (const name of ["R", "inertia", "light"]) this[name] = numbers(9);
    this.q = numbers(4);
    this.mass = numbers(1);
    this.moved = numbers(1);
    this.extent = numbers(1);
    this.awake = new Uint8Array(n);
    this.held = new Uint8Array(n);
    for (const i of held) this.held[i] = 1;
    this.spheres = new Float64Array(16 * SPHERES * n);
    this.balls = numbers(16);
    for (let i = 0; i < n; i++) this.addBody(i);
  }

  // Mass, inertia (Tonon 2005) and spheres of a body (mesh/topology.py).
  addBody(i) {
    const corners = [0, 1, 2, 3].map((k) => row(this.points, this.tetrahedra[4 * i + k]));
    const centre = [0, 1, 2].map((k) => corners.reduce((sum, c) => sum + c[k], 0) / 4);
    const arms = corners.map((c) => minus(c, centre)), edges = corners.slice(1).map((c) => minus(c, corners[0]));
    const mass = (this.material.density * dot(cross(edges[0], edges[1]), edges[2])) / 6;
    const second = [0, 1, 2].map((r) => [0, 1, 2].map((c) => (mass / 20) * arms.reduce((sum, a) => sum + a[r] * a[c], 0)));
    const trace = second[0][0] + second[1][1] + second[2][2];
    const inertia = second.map((r, k) => r.map((x, c) => (c === k ? trace : 0) - x));
    this.mass[i] = mass;
    this.centre.set(centre, 3 * i);
    this.inertia.set(inertia.flat(), 9 * i);
    this.light.set(inverse(inertia).flat(), 9 * i);
    this.extent[i] = Math.sqrt(Math.max(...arms.map((a) => dot(a, a))));
    const inward = FACES.map((f) => unit(cross(minus(arms[f[2]], arms[f[0]]), minus(arms[f[1]], arms[f[0]]))));
    FACES.forEach((face, f) => this.addSpheres(i, f, face.map((k) => arms[k]), inward, arms));
  }

  // Spheres tangent to a face, as large as the other faces allow; a ball around them.
  addSpheres(i, f, corners, inward, arms) {
    const made = CROSSINGS.map((share) => {
      const touch = [0, 1, 2].map((k) => corners.reduce((sum, c, n) => sum + (share[n] / 5) * c[k], 0));
      let radius = Infinity;
      for (let g = 0; g < 4; g++) {
        const height = dot(minus(touch, arms[FACES[g][0]]), inward[g]);
        if (g !== f) radius = Math.min(radius, height / (1 - dot(inward[f], inward[g])));
      }
      return [...touch.map((x, k) => x + radius * inward[f][k]), radius];
    });
    const middle = [0, 1, 2].map((k) => made.reduce((sum, s) => sum + s[k], 0) / SPHERES);
    const reach = Math.max(...made.map((s) => Math.sqrt(dot(minus(s, middle), minus(s, middle))) + s[3]));
    this.spheres.set(made.flat(), 4 * SPHERES * (4 * i + f));
    this.balls.set([...middle, reach], 4 * (4 * i + f));
  }

  // Faces that two bodies share: master is the body of lower index (Konno et al., section 2.1).
  addBonds() {
    const seen = new Map(), found = [];
    for (let face = 0; face < 4 * this.count; face++) {
      const at = FACES[face & 3].map((k) => this.tetrahedra[4 * (face >> 2) + k]);
      const key = [...at].sort((a, b) => a - b).join();
      if (seen.has(key)) found.push({ ...seen.get(key), slave: face });
      else seen.set(key, { master: face, at });
    }
    found.sort((a, b) => (a.master >> 2) - (b.master >> 2) || (a.slave >> 2) - (b.slave >> 2));
    const n = (this.bonds = found.length), numbers = (k) => new Float64Array(k * n);
    this.faces = new Int32Array(found.flatMap((b) => [b.master, b.slave]));
    for (const name of ["frame", "onMaster", "onSlave"]) this[name] = numbers(9);
    this.area = numbers(1);
    this.strain = numbers(1);
    this.limit = numbers(3);
    this.slipped = numbers(6);
    this.broken = new Uint8Array(n);
    this.acted = new Uint8Array(n);
    this.bondOf = new Int32Array(4 * this.count).fill(-1);
    found.forEach((bond, b) => this.addBond(bond, b));
  }

  addBond({ master, slave, at }, b) {
    const corners = at.map((p) => row(this.points, p));
    const normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    const size = Math.sqrt(dot(normal, normal)), out = times(normal, 1 / size);
    const xi = unit(minus(corners[1], corners[0])), frame = [out, xi, cross(out, xi)];
    this.frame.set(frame.flat(), 9 * b);
    this.area[b] = size / 6;
    this.onMaster.set(corners.flatMap((c) => along(frame, minus(c, row(this.centre, master >> 2)))), 9 * b);
    this.onSlave.set(corners.flatMap((c) => minus(c, row(this.centre, slave >> 2))), 9 * b);
    this.bondOf[master] = this.bondOf[slave] = b;
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

  // Spin R I^-1 R^T L [rad/s] (physics/rotation.py).
  findSpin(i, momentum, at, out, to) {
    const R = this.R, A = this.light, o = 9 * i, x = momentum[at], y = momentum[at + 1], z = momentum[at + 2];
    const a = R[o] * x + R[o + 3] * y + R[o + 6] * z, b = R[o + 1] * x + R[o + 4] * y + R[o + 7] * z;
    const c = R[o + 2] * x + R[o + 5] * y + R[o + 8] * z;
    const p = A[o] * a + A[o + 1] * b + A[o + 2] * c, q = A[o + 3] * a + A[o + 4] * b + A[o + 5] * c;
    const r = A[o + 6] * a + A[o + 7] * b + A[o + 8] * c;
    for (let k = 0; k < 3; k++) out[to + k] = R[o + 3 * k] * p + R[o + 3 * k + 1] * q + R[o + 3 * k + 2] * r;
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

  // Move and turn a body, by the spin in the middle of the step.
  drift(i) {
    const o = 3 * i, dt = this.dt, { x, v, L, w, q } = this, h = turning;
    const ahead = ahead3;
    ahead[0] = L[o] + 0.5 * dt * (L[o + 1] * w[o + 2] - L[o + 2] * w[o + 1]);
    ahead[1] = L[o + 1] + 0.5 * dt * (L[o + 2] * w[o] - L[o] * w[o + 2]);
    ahead[2] = L[o + 2] + 0.5 * dt * (L[o] * w[o + 1] - L[o + 1] * w[o]);
    this.findSpin(i, ahead, 0, h, 0);
    for (let k = 0; k < 3; k++) {
      x[o + k] += dt * v[o + k];
      h[k] *= 0.5 * dt;
    }
    const angle = Math.sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    const s = angle > 1e-6 ? Math.sin(angle) / angle : 1 - (angle * angle) / 6, c = Math.cos(angle);
    const a = q[4 * i], b = q[4 * i + 1], d = q[4 * i + 2], e = q[4 * i + 3], f = s * h[0], g = s * h[1], l = s * h[2];
    const t0 = c * a - f * b - g * d - l * e, t1 = c * b + f * a + g * e - l * d;
    const t2 = c * d - f * e + g * a + l * b, t3 = c * e + f * d - g * b + l * a;
    const size = 1 / Math.sqrt(t0 * t0 + t1 * t1 + t2 * t2 + t3 * t3);
    q[4 * i] = t0 * size;
    q[4 * i + 1] = t1 * size;
    q[4 * i + 2] = t2 * size;
    q[4 * i + 3] = t3 * size;
    this.findRotation(i);
  }

  findRotation(i) {
    const R = this.R, o = 9 * i, w = this.q[4 * i], x = this.q[4 * i + 1], y = this.q[4 * i + 2], z = this.q[4 * i + 3];
    R[o] = 1 - 2 * (y * y + z * z);
    R[o + 1] = 2 * (x * y - w * z);
    R[o + 2] = 2 * (x * z + w * y);
    R[o + 3] = 2 * (x * y + w * z);
    R[o + 4] = 1 - 2 * (x * x + z * z);
    R[o + 5] = 2 * (y * z - w * x);
    R[o + 6] = 2 * (x * z - w * y);
    R[o + 7] = 2 * (y * z + w * x);
    R[o + 8] = 1 - 2 * (x * x + y * y);
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

  // Spheres of broken faces that touch: repulsion and friction (step/contact_force.py).
  contacts() {
    if (this.exposed.length === 0) return;
    let most = 0;
    for (let i = 0; i < this.count; i++) {
      const way = size3(this.v, 3 * i) + this.extent[i] * size3(this.w, 3 * i);
      if (way > most) most = way;
    }
    // Ways of the step before, which pairs have made since they were found.
    this.room -= 2 * this.dt * most;
    if (this.room < 0) this.findNear(Math.max(SKIN, 60 * this.dt * most));
    for (let k = 0; k < this.near.length; k += 2) this.touch(this.near[k], this.near[k + 1]);
  }

  // Pairs of spheres nearer than a margin [m].
  findNear(margin) {
    const { exposed, balls, spheres } = this;
    const places = exposed.map((face) => this.placed(balls, face, face >> 2));
    const inner = new Map();
    const spheresOf = (face) => {
      if (!inner.has(face)) {
        const first = SPHERES * face;
        inner.set(face, CROSSINGS.map((_, k) => this.placed(spheres, first + k, face >> 2)));
      }
      return inner.get(face);
    };
    this.near = [];
    for (let a = 0; a < exposed.length; a++) {
      for (let b = a + 1; b < exposed.length; b++) {
        if (exposed[a] >> 2 === exposed[b] >> 2 || !within(places[a], places[b], margin)) continue;
        const one = exposed[a] < exposed[b] ? exposed[a] : exposed[b], other = exposed[a] + exposed[b] - one;
        spheresOf(one).forEach((s, k) => spheresOf(other).forEach((t, l) => {
          if (within(s, t, margin)) this.near.push(SPHERES * one + k, SPHERES * other + l);
        }));
      }
    }
    this.room = margin;
  }

  // A ball [x, y, z, radius] of a body in the world.
  placed(balls, at, i) {
    const R = this.R, o = 9 * i, x = balls[4 * at], y = balls[4 * at + 1], z = balls[4 * at + 2];
    const world = [0, 1, 2].map((k) => this.x[3 * i + k] + R[o + 3 * k] * x + R[o + 3 * k + 1] * y + R[o + 3 * k + 2] * z);
    return [...world, balls[4 * at + 3]];
  }

  touch(a, b) {
    const i = (a / (4 * SPHERES)) | 0, j = (b / (4 * SPHERES)) | 0, { x, v, w, R, S, T, dt, material: m } = this;
    const r1 = this.spheres[4 * a + 3], r2 = this.spheres[4 * b + 3], s = first3, t = second3, n = 3 * i, p = 3 * j;
    for (let k = 0; k < 3; k++) {
      const c = 9 * i + 3 * k, d = 9 * j + 3 * k;
      s[k] = R[c] * this.spheres[4 * a] + R[c + 1] * this.spheres[4 * a + 1] + R[c + 2] * this.spheres[4 * a + 2];
      t[k] = R[d] * this.spheres[4 * b] + R[d + 1] * this.spheres[4 * b + 1] + R[d + 2] * this.spheres[4 * b + 2];
    }
    const e0 = x[p] + t[0] - x[n] - s[0], e1 = x[p + 1] + t[1] - x[n + 1] - s[1], e2 = x[p + 2] + t[2] - x[n + 2] - s[2];
    const square = e0 * e0 + e1 * e1 + e2 * e2;
    if (square >= (r1 + r2) * (r1 + r2)) return;
    const distance = Math.sqrt(square), n0 = e0 / distance, n1 = e1 / distance, n2 = e2 / distance;
    const overlap = r1 + r2 - distance, lever = r1 - 0.5 * overlap;
    const a0 = s[0] + lever * n0, a1 = s[1] + lever * n1, a2 = s[2] + lever * n2;
    const b0 = a0 - x[p] + x[n], b1 = a1 - x[p + 1] + x[n + 1], b2 = a2 - x[p + 2] + x[n + 2];
    const u0 = v[p] + w[p + 1] * b2 - w[p + 2] * b1 - v[n] - w[n + 1] * a2 + w[n + 2] * a1;
    const u1 = v[p + 1] + w[p + 2] * b0 - w[p] * b2 - v[n + 1] - w[n + 2] * a0 + w[n] * a2;
    const u2 = v[p + 2] + w[p] * b1 - w[p + 1] * b0 - v[n + 2] - w[n] * a1 + w[n + 1] * a0;
    const rate = u0 * n0 + u1 * n1 + u2 * n2, c = m.contact_damping;
    const press = Math.max(0, m.contact_stiffness * overlap - c * rate);
    const g0 = u0 - rate * n0, g1 = u1 - rate * n1, g2 = u2 - rate * n2, slide = Math.sqrt(g0 * g0 + g1 * g1 + g2 * g2);
    const rub = this.effects.friction && slide > 0 ? -Math.min(m.friction * press, c * slide) / slide : 0;
    const f0 = dt * (press * n0 + rub * g0), f1 = dt * (press * n1 + rub * g1), f2 = dt * (press * n2 + rub * g2);
    S[n] -= f0;
    S[n + 1] -= f1;
    S[n + 2] -= f2;
    S[p] += f0;
    S[p + 1] += f1;
    S[p + 2] += f2;
    T[n] -= a1 * f2 - a2 * f1;
    T[n + 1] -= a2 * f0 - a0 * f2;
    T[n + 2] -= a0 * f1 - a1 * f0;
    T[p] += b1 * f2 - b2 * f1;
    T[p + 1] += b2 * f0 - b0 * f2;
    T[p + 2] += b0 * f1 - b1 * f0;
    this.pressed += 0.5 * m.contact_stiffness * overlap * overlap;
    this.heat.dashpots += dt * (m.contact_stiffness * overlap - press) * rate;
    this.heat.friction -= dt * rub * slide * slide;
    const bits = press > 0 ? (rub ? 12 : 4) : 0;
    this.bodyActed[i] |= bits;
    this.bodyActed[j] |= bits;
  }

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

// Least gap up to which spheres enter the list of pairs [m]: it changes time, not results.
const SKIN = 1e-3;
// Scratch of the loops above.
const [axes9, turn9] = [new Float64Array(9), new Float64Array(9)];
const [moved6, motion6] = [new Float64Array(6), new Float64Array(6)];
const [offset3, ahead3, turning, lin3, ang3, first3, second3] = Array.from({ length: 7 }, () => new Float64Array(3));

const size3 = (a, o) => Math.sqrt(a[o] * a[o] + a[o + 1] * a[o + 1] + a[o + 2] * a[o + 2]);

const failureOpening = (m) => (2 * m.fracture_energy) / m.tensile_strength;

// Traction at an opening beyond the onset (physics/fracture.py).
function softened(m, open) {
  const onset = m.tensile_strength / m.normal_stiffness, end = failureOpening(m);
  return Math.max(0, (m.tensile_strength * (end - open)) / (end - onset));
}

function within(a, b, margin) {
  const x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2], reach = a[3] + b[3] + margin;
  return x * x + y * y + z * z < reach * reach;
}

// Twist of the body at row p of y against that at row n, with its centre at d from the other's.
function twistBetween(y, n, p, d0, d1, d2, out) {
  out[0] = y[p] - y[n] - (y[n + 4] * d2 - y[n + 5] * d1);
  out[1] = y[p + 1] - y[n + 1] - (y[n + 5] * d0 - y[n + 3] * d2);
  out[2] = y[p + 2] - y[n + 2] - (y[n + 3] * d1 - y[n + 4] * d0);
  for (let k = 3; k < 6; k++) out[k] = y[p + k] - y[n + k];
}
