"use strict";
// Rigid tetrahedra, the faces that join them, and how they move (mesh/topology.py, physics/rotation.py).

// Corners of the four faces, outward (mesh/tetrahedra.py).
const FACES = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
// Inner crossings of a face whose edges are cut in five: the paper's six spheres (mesh/topology.py).
const CROSSINGS = [[1, 1, 3], [1, 2, 2], [1, 3, 1], [2, 1, 2], [2, 2, 1], [3, 1, 1]];
const SPHERES = CROSSINGS.length;

class Bodies {
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

  // Spin R I^-1 R^T L [rad/s] (physics/rotation.py).
  findSpin(i, momentum, at, out, to) {
    const R = this.R, A = this.light, o = 9 * i, x = momentum[at], y = momentum[at + 1], z = momentum[at + 2];
    const a = R[o] * x + R[o + 3] * y + R[o + 6] * z, b = R[o + 1] * x + R[o + 4] * y + R[o + 7] * z;
    const c = R[o + 2] * x + R[o + 5] * y + R[o + 8] * z;
    const p = A[o] * a + A[o + 1] * b + A[o + 2] * c, q = A[o + 3] * a + A[o + 4] * b + A[o + 5] * c;
    const r = A[o + 6] * a + A[o + 7] * b + A[o + 8] * c;
    for (let k = 0; k < 3; k++) out[to + k] = R[o + 3 * k] * p + R[o + 3 * k + 1] * q + R[o + 3 * k + 2] * r;
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
}
