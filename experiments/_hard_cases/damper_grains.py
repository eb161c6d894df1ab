"""Hard cases of the damper: few grains whose motion is known, and boxes at their limits."""

import numpy as np

from _hard_cases import _damper_run as scenes
from _hard_cases._damper_run import AUTOMATA, EXACT, SPHERES, drive, fall, filling
from ca_damper import Automaton, Batch, SceneTable, Spheres
from taichi_dem.kit.study.cases import Cases

case = CASES = Cases("damper")
G, SIZE = 9.8, 6e-3
#: No dashpot and no friction: motion of spheres is that of billiards, but for the step.
ELASTIC = {"restitution": 1.0, "wall_restitution": 1.0, "friction": 0.0, "wall_friction": 0.0}
#: Energy that the leapfrog misses in a contact, of six steps: (w dt)^2 / 24, w dt = pi / 6.
A_BLOW = (np.pi / 6.0) ** 2 / 24.0


def still(trial, what, particles, seconds):
    """Batch of grains after some time in a container at rest."""
    table = SceneTable(particles, 1, min(what.default_dt, what.safe_step()), 10.0, 0.0)
    batch = Batch(what, table, mount="base")
    batch.start()
    batch.advance(round(seconds / table.row(0)["dt"]))
    trial.compile_s += batch.compile_seconds
    return batch


def places(batch):
    """Places [m] and velocities [m/s] of the grains of a batch of one scene."""
    shot = batch.snapshot(0)
    return shot["position"], shot["velocity"]


@case(["spheres"])
def newtons_cradle(trial):
    """Five spheres in a row, a tenth of a millimetre apart: a blow goes through to the last one."""
    row = [(0.006 + k * (SIZE + 1e-4), 0.05) for k in range(5)]
    flying = [(0.1 * (k == 0), 0.0) for k in range(5)]
    what = Spheres(gravity=0.0, start=row, start_velocity=flying, **ELASTIC)
    # The blows take 5 x 1 ms, and the last sphere then flies freely.
    _, velocity = places(still(trial, what, 5, 0.02))
    speeds = velocity[:, 0] / 0.1
    wanted = [0.0, 0.0, 0.0, 0.0, 1.0]
    trial.limit("speed error / speed", abs(speeds - wanted), 4.0 * A_BLOW, "(w dt)^2 / 24 a blow")


@case(["spheres"])
def zeno_ball(trial):
    """A sphere that rebounds with half of its speed is at rest after infinitely many bounces."""
    what = Spheres(restitution=0.5, wall_restitution=0.5, start=[(0.03, 0.053)])
    # sqrt(2 h / g) (1 + e) / (1 - e) = 0.3 s; what is left sinks in by m g / k and swings out.
    _, velocity = places(still(trial, what, 1, 0.5))
    left = np.square(velocity).sum() / (2.0 * G * 0.05)
    trial.limit("energy left", left, 1e-6, "rest after sqrt(2 h / g) (1 + e) / (1 - e)")


@case(["spheres"])
def balanced_spheres(trial):
    """A sphere on top of another one stands, by symmetry, where any push would throw it off."""
    what = Spheres(start=[(0.03, 0.003), (0.03, 0.009)])
    place, _ = places(still(trial, what, 2, 0.2))
    trial.limit("way aside [m]", abs(place[:, 0] - 0.03), 0.0, "symmetry, to the bit")


@case(["spheres"])
def row_that_fits_exactly(trial):
    """Ten spheres of 6 mm in a box of 60 mm touch each other and both walls, and press on none."""
    row = [(0.003 + k * SIZE, 0.003) for k in range(10)]
    place, _ = places(still(trial, Spheres(start=row), 10, 0.1))
    aside = abs(place[:, 0] - np.array(row)[:, 0])
    trial.limit("way aside / size", aside / SIZE, 1e-9, "rounding of the places")


def dropped(trial, seconds, **options):
    """Energy over time of 36 spheres that fall from a square pattern."""
    pattern = [(0.006 + 0.0095 * i, 0.03 + 0.0095 * j) for i in range(6) for j in range(6)]
    what = Spheres(start=pattern, **options)
    return fall(trial, what, seconds, particles=36, samples=50)


@case(["spheres"])
def drop_without_restitution(trial):
    """36 balls fall into a box and stay where they fall."""
    energy = dropped(trial, 0.6, restitution=0.01, wall_restitution=0.01)
    settled = abs(np.diff(energy[-10:])) / energy[0]
    trial.limit("energy rise", np.diff(energy) / energy[0], 1e-6, "nothing gives any")
    trial.limit("still moving", settled, 1e-4, "at rest after two falls")


@case(["spheres"])
def drop_with_full_restitution(trial):
    """36 balls fall into a box and bounce for ever: no energy is lost, and none made."""
    energy = dropped(trial, 0.3, **ELASTIC)
    # Some ten blows a ball, of either sign.
    error = abs(energy / energy[0] - 1.0)
    trial.limit("energy error", error, 10.0**0.5 * A_BLOW, "(w dt)^2 / 24, ten blows")


def weighed(trial, gravity, part, bound, formula, **options):
    """Mean force upwards on a still container over the weight; part: what it should be."""
    what = filling(trial, gravity=gravity, **options)
    table = SceneTable(30, 1, min(what.default_dt, what.safe_step()), 10.0, 0.0)
    batch = Batch(what, table, mount="base", measured_cycles=5)
    batch.start()
    cycles = batch.run(20, 5)
    weight = 30 * what.particle_mass * np.linalg.norm(gravity)
    force = cycles.mean_force[0] / weight
    trial.limit("mean force error / weight", abs(force - part), bound, formula)
    trial.draw("cycle [1]", np.arange(5.0), "force / weight [1]", np.full(5, force))


@case(SPHERES)
def box_upside_down(trial):
    """Grains that fall upwards weigh on the ceiling."""
    weighed(trial, (0.0, -G), 1.0, 1e-3, "N m g, the specification")


@case(SPHERES)
def box_on_its_side(trial):
    """Grains that fall sideways have no weight along the motion."""
    weighed(trial, (G, 0.0), 0.0, 1e-3, "N m g across")


@case(SPHERES)
def thousand_g(trial):
    """Gravity of 1000 g: the heap weighs a thousand times as much, and does not burst."""
    weighed(trial, (0.0, 1e3 * G), -1.0, 1e-3, "N m g, the specification")


@case(SPHERES)
def grains_of_two_sizes(trial):
    """One sphere of 6 mm among a hundred of half a millimetre falls, and no energy is made."""
    what = filling(trial, sizes=((1, 6e-3), (100, 0.5e-3)))
    table = SceneTable(101, 1, what.safe_step(), 10.0, 0.0)
    batch = Batch(what, table, mount="base")
    batch.start()
    energy = [batch.sample()["energy"][0]]
    for _ in range(5):
        batch.advance(400 if trial.quick else 4000)
        energy.append(batch.sample()["energy"][0])
    trial.limit("energy rise", np.diff(energy) / energy[0], 1e-3, "they only fall")
    trial.limit("momentum error", batch.report().momentum_error, 1e-9, "rounding")


@case((*AUTOMATA, *SPHERES))
def alone_and_in_a_batch(trial):
    """A scene has the same bits alone and beside others with other numbers."""
    what = filling(trial)
    table = SceneTable([30, 50, 7], [1, 2, 3], what.default_dt, [6.0, 5.5, 9.0], 0.015)
    shots = []
    for rows in (table, SceneTable(**table.row(1))):
        batch = Batch(what, rows, mount="base")
        batch.start()
        batch.advance(1000)
        shots.append(batch.snapshot(rows.count // 2)["position"])
    trial.limit("difference [m]", abs(shots[0] - shots[1]), 0.0, "same bits")


def lattice(columns, rows, particles):
    """A case of a lattice of another shape."""

    def run(trial):
        what = filling(trial, columns=columns, rows=rows)
        drive(trial, what, particles, 5 if trial.quick else 50).speed_bounded()

    return run


SHAPES = {"one_column": (1, 16, 8), "one_row": (10, 1, 5), "wide_lattice": (500, 3, 700)}
for name, shape in SHAPES.items():
    question = f"Particles in a lattice of {shape[0]} x {shape[1]} cells: none is lost."
    case.add(name, question, lattice(*shape), ["automaton"])


@case(["automaton"])
def grains_by_place_full(trial):
    """Grains by the rules of place, every cell taken: their number and momentum are kept."""
    what = Automaton()
    batch = Batch(what, SceneTable(what.capacity, 1, 1e-4, 6.0, 0.024), mount="base")
    batch.start()
    batch.run(2, 1)
    place, _ = places(batch)
    inside = (place > -SIZE).all(axis=1) & (place[:, 0] < 0.066) & (place[:, 1] < 0.105)
    trial.limit("particles lost", what.capacity - inside.sum(), 0.0, "their number is exact")
    trial.limit("momentum error", batch.report().momentum_error, 1e-9, "rounding")


@case(EXACT)
def slow_base(trial):
    """24 mm at 0.5 Hz, a fiftieth of gravity: grains ride along as a mass."""
    what = filling(trial)
    options = {"frequency": 0.5, "transient": 1}
    run = scenes.Run(trial, what, 20, 1 if trial.quick else 5, base_amplitude=0.024, **options)
    run.kept_inside()
    mass = run.cycles.apparent_mass[0] / (20 * what.particle_mass)
    # Grains that creep or fall by a cell move the mass by a part of the amplitude.
    trial.limit("apparent mass error", abs(mass - 1.0), SIZE / 0.024, "a cell / amplitude")


@case((), (["spheres"], "start"))
def spheres_at_one_place(_):
    """Two spheres that begin at one place."""
    Spheres(start=[(0.03, 0.03), (0.03, 0.03)]).check(2, 2e-5)


@case((), (["spheres"], "at least the diameter"))
def sphere_larger_than_its_box(_):
    """A sphere that is larger than its box."""
    Spheres(width=5e-3)
