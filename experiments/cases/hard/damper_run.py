"""A run of a hard case of the damper: fillings by name, and the limits that many share."""

from dataclasses import replace

import numpy as np

from ca_damper import Automaton, Batch, Empty, Oscillator, Paper, SceneTable, Spheres, film
from ca_damper.plot.boxes import BoxSize
from ca_damper.report.measures import COLUMNS

FILLINGS = {
    "automaton": Automaton(Paper()),
    "automaton_ejection": Automaton(Paper("landing+ejection")),
    "automaton_landing": Automaton(Paper("landing")),
    "spheres": Spheres(),
    "spheres_printed": Spheres(damping="printed"),
    "empty": Empty(),
}
AUTOMATA, SPHERES = tuple(FILLINGS)[:3], tuple(FILLINGS)[3:5]
ALL = (*AUTOMATA, *SPHERES)
#: Those whose account of forces keeps momentum.
EXACT = ("automaton", *SPHERES)
OSCILLATOR = Oscillator()
EPS = np.finfo(float).eps


def filling(trial, automaton=None, spheres=None, **shared):
    """The filling of a trial; options: for all, and for automata or spheres only."""
    own = automaton if trial.method in AUTOMATA else spheres
    return replace(FILLINGS[trial.method], **shared, **(own or {}))


class Run:
    """A measured run of one scene, by default at 6 Hz in a container that swings by 24 mm.

    what: its filling. transient: cycles before measuring. columns: of ``SceneTable``.
    """

    def __init__(self, trial, what, particles, cycles, *, spring=False, transient=0, **columns):
        columns = {"dt": what.default_dt, "frequency": 6.0, "base_amplitude": 0.024, **columns}
        table, mount = SceneTable(particles, 1, **columns), "spring" if spring else "base"
        self.batch = Batch(what, table, mount=mount, measured_cycles=cycles)
        self.batch.start("rigid" if spring else "rest")
        # At least one step: the first takes the particles to the speed of the container.
        self.batch.run(max(1, transient), 0)
        before = self.batch.sample()["momentum"][0]
        self.cycles = self.batch.run(0, cycles)
        self.momentum_gained = self.batch.sample()["momentum"][0] - before
        self.trial, self.what, self.particles = trial, what, particles
        trial.compile_s += self.batch.compile_seconds
        self.row, self.steps = self.batch.table.row(0), int(self.batch.steps_per_cycle[0])
        self.time = cycles / self.row["frequency"]
        self.omega = 2.0 * np.pi * self.row["frequency"]
        self.mass = particles * what.particle_mass

    def column(self, name):
        """A column of ``measures.COLUMNS`` over the measured cycles, (cycles,)."""
        return self.cycles.record[0, :, COLUMNS.index(name)]

    def sound(self):
        """Limits that always hold: particles inside, and momentum where it is kept exactly."""
        self.kept_inside()
        if self.trial.method in EXACT:
            self.momentum_kept()

    def kept_inside(self):
        """No particle is missing or out of the box.

        In an automaton one may be a cell under way, and every other column stands half a cell
        higher.
        """
        place, box = self.batch.snapshot(0)["position"], BoxSize.of(self.what)
        slack = box.diameter * box.staggered
        top = np.array([box.width, box.height + 0.5 * slack])
        inside = ((place >= -slack) & (place <= top + slack)).all(axis=1)
        lost = self.particles - inside.sum()
        self.trial.limit("particles lost", lost, 0.0, "their number is exact")

    def momentum_kept(self):
        """P' = -f - N m g: the container's loss and the weight's impulse are the particles' gain.

        As a share of N m v, v the container's largest speed. The automaton's held particles count
        with the container's velocity of a step ago: off by a dt / v = w dt. Otherwise round-off of
        a step and quanta of 2^-40 m/s.
        """
        given = -(self.cycles.mean_force[0] + self.mass * self.what.gravity) * self.time
        swing = 0.5 * (self.column("x_max").max() - self.column("x_min").min())
        steps = self.steps * len(self.column("x"))
        bound, formula = 10.0 * steps * EPS, "10 steps x 2^-52"
        if self.trial.method in AUTOMATA:
            bound = 2.0 * self.omega * self.row["dt"]
            formula = "2 w dt: held particles count a step late"
        error = abs(self.momentum_gained - given) / (self.mass * self.omega * swing)
        self.trial.limit("momentum error / N m v", error, bound, formula)

    def weight_carried(self, bound, formula):
        """Mean force on the container against -N m g, as a share of it."""
        weight = self.mass * self.what.gravity
        error = abs(self.cycles.mean_force[0] + weight) / weight
        self.trial.limit("mean force error", error, bound, formula)

    def rigid_response(self, bound, formula):
        """RMS displacement against that of a structure with the particles glued in."""
        o = Oscillator(*(self.row[n] for n in ("mass", "stiffness", "damping", "base_amplitude")))
        wanted = o.rms(self.row["frequency"], self.mass)
        error = abs(self.cycles.rms[0] / wanted - 1.0)
        self.trial.limit("response error", error, bound, formula)

    def speed_bounded(self):
        """No particle gets faster than the walls and the fall can make it.

        Between two walls that move at V towards it, a speed v comes back as e v + (1 + e) V: at
        most V (1 + e) / (1 - e), plus the fall through the box and g dt for each of four steps seen
        late.
        """
        what = self.what
        wall = self.omega * max(self.column("x_max").max(), -self.column("x_min").min())
        e = max(what.wall_restitution, what.restitution)
        bound = wall * (1.0 + e) / (1.0 - e) + np.sqrt(2.0 * what.gravity * BoxSize.of(what).height)
        bound += 4.0 * what.gravity * self.row["dt"]
        fastest = np.linalg.norm(self.batch.snapshot(0)["velocity"], axis=1).max(initial=0.0)
        self.trial.limit("fastest [m/s]", fastest, bound, "V (1 + e) / (1 - e) + sqrt(2 g H)")


def drive(trial, what, particles, cycles, **options):
    """A container that moves as told, x = amplitude sin(2 pi f t); returns a sound Run."""
    run = Run(trial, what, particles, cycles, **options)
    run.sound()
    return run


def spring(trial, what, particles, cycles, *, ratio=1.0, base=0.6e-3, **options):
    """A container on its spring, from the steady state of a rigid filling; ratio: f / f0.

    f0: of the paper's structure, whatever the mass [kg] of the container here.
    """
    options.update(frequency=ratio * OSCILLATOR.natural_frequency, base_amplitude=base)
    return Run(trial, what, particles, cycles, spring=True, **options)


def still(trial, what, particles, dt=None, **options):
    """Batch of particles that start in a container at rest."""
    dt = dt or min(what.default_dt, what.safe_step())
    batch = Batch(what, SceneTable(particles, 1, dt, 10.0, 0.0), mount="base", **options)
    batch.start()
    trial.compile_s += batch.compile_seconds
    return batch


def fall(trial, what, seconds, particles=1, samples=400):
    """Energy of particles in a container at rest [J]."""
    batch = still(trial, what, particles, what.default_dt)
    every = max(1, round(seconds / samples / batch.table.row(0)["dt"]))
    history = film(batch, every * samples, sample_every=every).history
    return history["energy"][:, 0]
