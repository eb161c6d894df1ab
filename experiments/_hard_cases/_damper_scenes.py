"""Scenes of the damper's hard cases: fillings by name, runs, and figures that always hold."""

from dataclasses import dataclass, replace

import numpy as np

from _hard_cases._case import Curves, Limit
from ca_damper import Automaton, Batch, Empty, Oscillator, RigidMass, SceneTable, Spheres, film
from ca_damper.measures import COLUMNS

AUTOMATA = ("automaton", "automaton_ejection", "automaton_landing")
SPHERES = ("spheres", "spheres_printed")
#: Those whose account of forces keeps momentum.
EXACT = ("automaton", *SPHERES)
_FILLINGS = {
    "automaton": Automaton(),
    "automaton_ejection": Automaton(accounting="landing+ejection"),
    "automaton_landing": Automaton(accounting="landing"),
    "spheres": Spheres(),
    "spheres_printed": Spheres(damping="printed"),
    "rigid": RigidMass(),
    "empty": Empty(),
}
OSCILLATOR = Oscillator()
NATURAL = OSCILLATOR.natural_frequency
EPS = np.finfo(float).eps


def filling(method, automaton=None, spheres=None, **shared):
    """The filling of a method; options: for all, and for automata or spheres only."""
    own = automaton if method in AUTOMATA else spheres if method in SPHERES else None
    return replace(_FILLINGS[method], **shared, **(own or {}))


@dataclass(frozen=True, eq=False)
class Run:
    """A run of one scene, measured: batch, what it measured, states before and after."""

    batch: Batch
    cycles: object
    before: dict
    after: dict

    @property
    def particles(self):
        """Number of them."""
        return int(self.batch.table.row(0)["particles"])

    @property
    def dt(self):
        """Step used [s]."""
        return self.batch.table.row(0)["dt"]

    def column(self, name):
        """A column of ``measures.COLUMNS`` over the measured cycles, (cycles,)."""
        return self.cycles.record[0, :, COLUMNS.index(name)]


def drive(what, particles, cycles, *, dt=None, frequency=6.0, amplitude=0.024, transient=0):
    """A container that is moved as told, x = amplitude sin(2 pi f t)."""
    table = SceneTable(particles, 1, dt or what.default_dt, frequency, amplitude)
    return _measured(Batch(what, table, mount="base", measured_cycles=cycles), cycles, transient)


def spring(what, particles, cycles, *, ratio=1.0, base=0.6e-3, dt=None, transient=0, mass=0.086):
    """A container on its spring, from the steady state of a rigid filling; ratio: f / f0.

    f0: of the paper's structure, whatever the mass [kg] of the container here.
    """
    structure = (base, mass, OSCILLATOR.stiffness, OSCILLATOR.damping)
    table = SceneTable(particles, 1, dt or what.default_dt, ratio * NATURAL, *structure)
    batch = Batch(what, table, measured_cycles=cycles)
    return _measured(batch, cycles, transient, "rigid")


def _measured(batch, cycles, transient, start="rest"):
    batch.start(start)
    # At least one step: the first takes the particles to the speed of the container.
    batch.run(max(1, transient), 0)
    before = batch.sample()
    seen = batch.run(0, cycles)
    return Run(batch, seen, before, batch.sample())


def fall(what, seconds, samples=400, particles=1):
    """Particles in a container at rest: history of ``film``."""
    table = SceneTable(particles, 1, what.default_dt, 10.0, 0.0)
    batch = Batch(what, table, mount="base")
    batch.start()
    every = max(1, round(seconds / samples / batch.table.row(0)["dt"]))
    return film(batch, every * samples, sample_every=every).history


def kept_inside(run):
    """Particles that are missing or out of the box: none may be."""
    place, what = run.batch.snapshot(0)["position"], run.batch.filling
    if isinstance(what, Automaton):
        # A particle may be a cell under way, and every other column stands half a cell higher.
        size, slack = (what.width * what.columns, what.width * (what.rows + 0.5)), what.width
    else:
        size, slack = (what.width, what.height), 0.0
    inside = (place >= -slack) & (place <= np.array(size) + slack)
    lost = run.particles - int(inside.all(axis=1).sum())
    return Limit("particles lost", lost, 0.0, "their number is exact")


def momentum_kept(run):
    """P' = -f - N m g: what the container lost and the weight gave must be what particles gained.

    As a share of N m v, v the container's largest speed. The automaton's held particles count with
    the container's velocity of a step ago: off by a dt / v = w dt. Otherwise round-off of a step
    and quanta of 2^-40 m/s.
    """
    what, n = run.batch.filling, run.particles
    row, count = run.batch.table.row(0), run.cycles.record.shape[1]
    time, mass = count / row["frequency"], n * what.particle_mass
    given = -(run.cycles.mean_force[0] + mass * what.gravity) * time
    gained = run.after["momentum"][0] - run.before["momentum"][0]
    omega = 2.0 * np.pi * row["frequency"]
    swing = 0.5 * (run.column("x_max").max() - run.column("x_min").min())
    steps = count * int(run.batch.steps_per_cycle[0])
    bound, formula = 10.0 * steps * EPS, "10 steps x 2^-52"
    if isinstance(what, Automaton):
        bound, formula = 2.0 * omega * row["dt"], "2 w dt: held particles count a step late"
    error = abs(gained - given) / (mass * omega * swing)
    return Limit("momentum error / N m v", float(error), float(bound), formula)


def weight_carried(run, bound, formula):
    """Mean force on the container against -N m g, as a share of it."""
    weight = run.particles * run.batch.filling.particle_mass * run.batch.filling.gravity
    error = abs(float(run.cycles.mean_force[0]) + weight) / weight
    return Limit("mean force error", error, bound, formula)


def rigid_response(run, bound, formula):
    """RMS displacement against that of a structure with the particles glued in."""
    row = run.batch.table.row(0)
    o = Oscillator(row["mass"], row["stiffness"], row["damping"], row["base_amplitude"])
    added = run.particles * run.batch.filling.particle_mass
    wanted = o.base_amplitude * abs(o.transfer(row["frequency"], added)) / np.sqrt(2.0)
    error = abs(run.cycles.rms[0] / wanted - 1.0)
    return Limit("response error", float(error), bound, formula)


def speed_bounded(run):
    """No particle gets faster than what the walls and the fall can give it.

    Between two walls that move at V towards it, a speed v comes back as e v + (1 + e) V: at most
    V (1 + e) / (1 - e), plus the fall through the box and g dt for each of four steps seen late.
    """
    row, what = run.batch.table.row(0), run.batch.filling
    wall = (
        2.0 * np.pi * row["frequency"] * max(run.column("x_max").max(), -run.column("x_min").min())
    )
    e = max(what.wall_restitution, what.restitution)
    height = what.rows * what.width if isinstance(what, Automaton) else what.height
    bound = wall * (1.0 + e) / (1.0 - e) + np.sqrt(2.0 * what.gravity * height)
    bound += 4.0 * what.gravity * row["dt"]
    fastest = np.linalg.norm(run.batch.snapshot(0)["velocity"], axis=1).max(initial=0.0)
    return Limit("fastest [m/s]", float(fastest), float(bound), "V (1 + e) / (1 - e) + sqrt(2 g H)")


def energies(run, method):
    """Energy of the particles at the end of every cycle, to draw."""
    energy = 1e3 * run.column("energy")
    cycle = np.arange(1, len(energy) + 1)
    return Curves("cycle [1]", "energy of the particles [mJ]", {method: (cycle, energy)})


def swings(run, method):
    """Highest and lowest displacement of every cycle, to draw."""
    cycle = np.arange(1, len(run.column("x_max")) + 1)
    lines = {method: (cycle, 1e3 * run.column("x_max")), "": (cycle, 1e3 * run.column("x_min"))}
    return Curves("cycle [1]", "highest and lowest x [mm]", lines)


def places(run, method):
    """Where the particles are, to draw."""
    place = 1e3 * run.batch.snapshot(0)["position"]
    return Curves("across [mm]", "up [mm]", {method: (place[:, 0], place[:, 1])}, dots=True)
