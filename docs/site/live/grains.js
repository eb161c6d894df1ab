"use strict";
// Spheres in a box on a spring by the laws of ca_damper: spheres/forces.py, contact_law.py, engine.
// Numbers of a contact of two spheres and of a sphere with a wall are those of the package.

// Gap up to which pairs are listed [m]: it changes time, not results.
const MARGIN = 1.5e-3;

class Damper {
  // places: of the grains from the lower left inner corner [m], two numbers each.
  constructor(numbers, places, { free = true, height = numbers.height, displacement = 0, velocities = null } = {}) {
    const { dt, grain, container } = numbers, n = (this.count = places.length / 2);
    Object.assign(this, { dt, free, grain, container, height, width: numbers.width, gravity: numbers.gravity });
    this.mass = container.mass + (free ? 0 : n * grain.mass);
    // A carried mass hangs lower by its weight.
    this.weight = free ? 0 : (n * grain.mass * this.gravity) / this.mass;
    this.x = displacement;
    this.v = this.impulse = this.steps = this.room = 0;
    this.places = Float64Array.from(places, (place, k) => (k % 2 ? place + displacement : place - 0.5 * this.width));
    this.velocity = velocities ? Float64Array.from(velocities) : new Float64Array(2 * n);
    // Positions run half a step ahead of velocities.
    for (let k = 0; k < 2 * n; k++) this.places[k] += 0.5 * dt * this.velocity[k];
    this.force = new Float64Array(2 * n);
    this.near = [];
    this.pair = contactOver(numbers.pair, dt);
    // The container recoils from what hits its floor and ceiling.
    const share = 1 / (1 + numbers.wall.mass / container.mass), wall = numbers.wall;
    this.side = contactOver(wall, dt);
    this.side.grip *= share;
    this.ends = contactOver({ ...wall, damping: wall.damping * Math.sqrt(share) }, dt);
    this.ends.yielding += (0.5 * dt) / container.mass;
  }

  // Acceleration of the box by spring, dashpot and weight, without impacts [m/s^2].
  pull(x, v) {
    return -(this.container.stiffness * x + this.container.damping * v) / this.mass - this.weight;
  }

  // push: acceleration of the box from outside [m/s^2], such as of a shaken phone.
  step(push = 0) {
    const { dt } = this, a = this.pull(this.x, this.v) + push;
    this.impulse = this.free ? -dt * this.grains(a) : 0;
    this.integrate(push + this.impulse / (dt * this.mass));
    this.steps++;
  }

  // Runge and Kutta's classical step: exact to rounding, as a step is a thousandth of a period.
  integrate(by) {
    const { dt, x, v } = this, h = 0.5 * dt, a1 = this.pull(x, v) + by, v2 = v + h * a1, a2 = this.pull(x + h * v, v2) + by;
    const v3 = v + h * a2, a3 = this.pull(x + h * v2, v3) + by, v4 = v + dt * a3, a4 = this.pull(x + dt * v3, v4) + by;
    this.x = x + (dt / 6) * (v + 2 * v2 + 2 * v3 + v4);
    this.v = v + (dt / 6) * (a1 + 2 * a2 + 2 * a3 + a4);
  }

  // Advance the grains; force of floor and ceiling on them [N].
  grains(a) {
    const { dt, places, velocity, force, gravity, grain } = this, n = this.count;
    if (this.room <= 0) this.findNear();
    for (let k = 0; k < this.near.length; k += 2) this.pairForce(2 * this.near[k], 2 * this.near[k + 1]);
    const total = this.walls(this.x + 0.5 * dt * (this.v + 0.25 * dt * a), this.v + 0.5 * dt * (a + gravity));
    let fastest = 0;
    for (let k = 0; k < 2 * n; k++) {
      velocity[k] += dt * (force[k] / grain.mass - (k % 2 ? gravity : 0));
      places[k] += dt * velocity[k];
      force[k] = 0;
      fastest = Math.max(fastest, Math.abs(velocity[k]));
    }
    this.room -= 3 * dt * fastest;
    return total;
  }

  findNear() {
    const { places, pair } = this, most = (pair.reach + MARGIN) ** 2;
    this.near = [];
    for (let i = 0; i < this.count; i++) {
      for (let j = i + 1; j < this.count; j++) {
        const x = places[2 * j] - places[2 * i], y = places[2 * j + 1] - places[2 * i + 1];
        if (x * x + y * y < most) this.near.push(i, j);
      }
    }
    this.room = MARGIN;
  }

  pairForce(i, j) {
    const { places, velocity, force, pair } = this, x = places[j] - places[i], y = places[j + 1] - places[i + 1], square = x * x + y * y;
    if (square >= pair.reach * pair.reach) return;
    const distance = Math.sqrt(square), nx = x / distance, ny = y / distance;
    const rx = velocity[i] - velocity[j], ry = velocity[i + 1] - velocity[j + 1];
    const push = normalForce(pair, pair.reach - distance, rx * nx + ry * ny), drag = frictionForce(pair, push, ry * nx - rx * ny);
    const fx = -push * nx - drag * ny, fy = -push * ny + drag * nx;
    force[i] += fx;
    force[i + 1] += fy;
    force[j] -= fx;
    force[j + 1] -= fy;
  }

  // Forces of the walls; floor: its height [m], rate: speed of the container as falling grains see it.
  walls(floor, rate) {
    const { places, velocity, force, side, ends } = this, reach = side.reach, half = 0.5 * this.width;
    let total = 0;
    for (let k = 0; k < 2 * this.count; k += 2) {
      const x = places[k], y = places[k + 1] - floor, vx = velocity[k], vy = velocity[k + 1] - rate, before = force[k + 1];
      if (x < reach - half) this.wall(k, side, -1, 0, reach - half - x, vx, vy);
      if (x > half - reach) this.wall(k, side, 1, 0, x - half + reach, vx, vy);
      if (y < reach) this.wall(k, ends, 0, -1, reach - y, vx, vy);
      if (y > this.height - reach) this.wall(k, ends, 0, 1, y - this.height + reach, vx, vy);
      total += force[k + 1] - before;
    }
    return total;
  }

  wall(k, contact, nx, ny, overlap, vx, vy) {
    const push = normalForce(contact, overlap, vx * nx + vy * ny), drag = frictionForce(contact, push, vy * nx - vx * ny);
    this.force[k] += -push * nx - drag * ny;
    this.force[k + 1] += -push * ny + drag * nx;
  }

  // Amplitude of the swing that the box would go on with alone [m].
  get swing() {
    const omega2 = this.container.stiffness / this.mass, rest = -this.weight / omega2;
    return Math.sqrt((this.x - rest) ** 2 + this.v ** 2 / omega2);
  }
}

// Numbers of a contact for a step [s] (spheres/contact_law.py).
function contactOver({ stiffness, damping, friction, reach, mass }, dt) {
  return { stiffness, damping, friction, reach, yielding: (0.5 * dt) / mass, grip: (0.25 * mass) / dt };
}

// Repulsion at an overlap [m] that grows by approach [m/s]; never a pull.
function normalForce({ stiffness, damping, yielding }, overlap, approach) {
  const root = Math.sqrt(overlap), dashpot = damping * Math.sqrt(root);
  return Math.max(0, stiffness * overlap * root + dashpot * approach) / (1 + dashpot * yielding);
}

// Friction against a slip [m/s], bounded by the grip at small slip.
function frictionForce({ friction, grip }, push, slip) {
  return -Math.max(-friction * push, Math.min(friction * push, grip * slip));
}

// Places of grains in rows from the floor, as many as are asked for.
function rowsOf(count, { width, grain }) {
  const columns = Math.floor(width / (2.05 * grain.radius)), places = [];
  for (let k = 0; k < count; k++) {
    const level = Math.floor(k / columns), shift = level % 2 ? 0.55 : 0.1;
    places.push(grain.radius * (1 + shift) + (k % columns) * ((width - 2.7 * grain.radius) / (columns - 1)), grain.radius * (1.001 + 2 * level));
  }
  return places;
}
