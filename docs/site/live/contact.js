"use strict";
// Spheres on broken faces that touch (laws/sphere_geometry.py, step/contact_force.py).

// Least gap up to which spheres enter the list of pairs [m]: it changes time, not results.
const SKIN = 1e-3;

class TouchingBodies extends Bodies {
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
}

function within(a, b, margin) {
  const x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2], reach = a[3] + b[3] + margin;
  return x * x + y * y + z * z < reach * reach;
}
