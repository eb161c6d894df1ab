"""Hard cases of the damper: few grains whose motion is known, boxes and structures at limits."""

import numpy as np

from ca_damper import Automaton, Batch, Empty, RigidMass, SceneTable, Spheres
from cases.hard import Cases, damper_run
from cases.hard.damper_run import AUTOMATA, EXACT, OSCILLATOR, SPHERES, drive, fall, filling

case = CASES = Cases("damper")
G, SIZE = 9.8, 6e-3
#: No dashpot and no friction: motion of spheres is that of billiards, but for the step.
ELASTIC = {"restitution": 1.0, "wall_restitution": 1.0, "friction": 0.0, "wall_friction": 0.0}
#: Energy that the leapfrog misses in a contact, of six steps: (w dt)^2 / 24, w dt = pi / 6.
A_BLOW = (np.pi / 6.0) ** 2 / 24.0
M, K = OSCILLATOR.mass, OSCILLATOR.stiffness
#: Frequency of the empty structure [Hz], and motion of the base [m].
F, Y = OSCILLATOR.natural_frequency, 0.6e-3
#: A share of what RK45 allows a step, over the steps of some hundred cycles.
TOLERANCE = 1e-6


def rested(trial, what, particles, seconds):
    """Places [m] and velocities [m/s] of grains after some time in a container at rest."""
    batch = damper_run.still(trial, what, particles)
    batch.advance(round(seconds / batch.table.row(0)["dt"]))
    shot = batch.snapshot(0)
    return shot["position"], shot["velocity"]


@case(["spheres"])
def newtons_cradle(trial):
    """Five spheres in a row, a tenth of a millimetre apart: a blow goes through to the last one."""
    row = [(0.006 + k * (SIZE + 1e-4), 0.05) for k in range(5)]
    flying = [(0.1 * (k == 0), 0.0) for k in range(5)]
    what = Spheres(gravity=0.0, start=row, start_velocity=flying, **ELASTIC)
    # The blows take 5 x 1 ms, and the last sphere then flies freely.
    _, velocity = rested(trial, what, 5, 0.02)
    off = abs(velocity[:, 0] / 0.1 - [0.0, 0.0, 0.0, 0.0, 1.0])
    trial.limit("speed error / speed", off, 4.0 * A_BLOW, "(w dt)^2 / 24 a blow")


@case(["spheres"])
def zeno_ball(trial):
    """A sphere that rebounds with half of its speed is at rest after infinitely many bounces."""
    what = Spheres(restitution=0.5, wall_restitution=0.5, start=[(0.03, 0.053)])
    # sqrt(2 h / g) (1 + e) / (1 - e) = 0.3 s; what is left sinks in by m g / k and swings out.
    _, velocity = rested(trial, what, 1, 0.5)
    left = np.square(velocity).sum() / (2.0 * G * 0.05)
    trial.limit("energy left", left, 1e-6, "rest after sqrt(2 h / g) (1 + e) / (1 - e)")


@case(["spheres"])
def balanced_spheres(trial):
    """A sphere on top of another one stands, by symmetry, where any push would throw it off."""
    place, _ = rested(trial, Spheres(start=[(0.03, 0.003), (0.03, 0.009)]), 2, 0.2)
    trial.limit("way aside [m]", abs(place[:, 0] - 0.03), 0.0, "symmetry, to the bit")


@case(["spheres"])
def row_that_fits_exactly(trial):
    """Ten spheres of 6 mm in a box of 60 mm touch each other and both walls, and press on none."""
    row = [(0.003 + k * SIZE, 0.003) for k in range(10)]
    place, _ = rested(trial, Spheres(start=row), 10, 0.1)
    aside = abs(place[:, 0] - np.array(row)[:, 0])
    trial.limit("way aside / size", aside / SIZE, 1e-9, "rounding of the places")


def dropped(trial, seconds, **options):
    """Energy over time of 36 spheres that fall from a square pattern, over that at the start."""
    pattern = [(0.006 + 0.0095 * i, 0.03 + 0.0095 * j) for i in range(6) for j in range(6)]
    what = Spheres(start=pattern, **options)
    energy = fall(trial, what, seconds, particles=36, samples=50)
    return energy / energy[0]


@case(["spheres"])
def drop_without_restitution(trial):
    """36 balls fall into a box and stay where they fall."""
    energy = dropped(trial, 0.6, restitution=0.01, wall_restitution=0.01)
    trial.limit("energy rise", np.diff(energy), 1e-6, "nothing gives any")
    settled = abs(np.diff(energy[-10:]))
    trial.limit("still moving", settled, 1e-4, "at rest after two falls")


@case(["spheres"])
def drop_with_full_restitution(trial):
    """36 balls fall into a box and bounce for ever: no energy is lost, and none made."""
    error = abs(dropped(trial, 0.3, **ELASTIC) - 1.0)
    # Some ten blows a ball, of either sign.
    trial.limit("energy error", error, 10.0**0.5 * A_BLOW, "(w dt)^2 / 24, ten blows")


@case(
    SPHERES,
    box_upside_down=((0.0, -G), 1.0, "upwards weigh on the ceiling"),
    box_on_its_side=((G, 0.0), 0.0, "sideways have no weight along the motion"),
    thousand_g=((0.0, 1e3 * G), -1.0, "at 1000 g weigh a thousand times as much"),
)
def weighed(trial, gravity, share, _):
    """Grains that fall {2}."""
    what = filling(trial, gravity=gravity)
    batch = damper_run.still(trial, what, 30, measured_cycles=5)
    weight = 30 * what.particle_mass * np.linalg.norm(gravity)
    force = batch.run(20, 5).mean_force[0] / weight
    trial.limit("mean force error / weight", abs(force - share), 1e-3, "N m g, the specification")


@case(SPHERES)
def grains_of_two_sizes(trial):
    """One sphere of 6 mm among a hundred of half a millimetre falls, and no energy is made."""
    what = filling(trial, sizes=((1, 6e-3), (100, 0.5e-3)))
    batch = damper_run.still(trial, what, 101, what.safe_step())
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


@case(["automaton"], one_column=(1, 16, 8), one_row=(10, 1, 5), wide_lattice=(500, 3, 700))
def lattice(trial, columns, rows, particles):
    """Particles in a lattice of {0} x {1} cells: none is lost."""
    what = filling(trial, columns=columns, rows=rows)
    drive(trial, what, particles, 5 if trial.quick else 50).speed_bounded()


@case(["automaton"])
def grains_by_place_full(trial):
    """Grains by the rules of place, every cell taken: their number and momentum are kept."""
    what = Automaton()
    run = damper_run.Run(trial, what, what.capacity, 1, transient=2, dt=1e-4)
    run.kept_inside()
    trial.limit("momentum error", run.batch.report().momentum_error, 1e-9, "rounding")


@case(EXACT)
def slow_base(trial):
    """24 mm at 0.5 Hz, a fiftieth of gravity: grains ride along as a mass."""
    cycles = 1 if trial.quick else 5
    run = damper_run.Run(trial, filling(trial), 20, cycles, frequency=0.5, transient=1)
    run.kept_inside()
    mass = run.cycles.apparent_mass[0] / run.mass
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


# Structures far from that of the paper, from their steady state on. The million particles have no
# weight: they would hang 16 m low, of which RK45 keeps nine digits.
@case(
    ["empty"],
    overdamped_structure=("A hundred times critical damping", {"damping": 200.0 * (K * M) ** 0.5}),
    stiff_structure=("A spring 1e4 times as stiff", {"stiffness": 1e4 * K, "cycles": 5}),
    soft_structure=("A spring 1e6 times as soft, far above its resonance", {"stiffness": 1e-6 * K}),
    container_of_a_milligram=("A container of 1 mg", {"mass": 1e-6, "cycles": 5}),
    container_of_a_thousand_tonnes=("A container of 1e6 kg", {"mass": 1e6, "stiffness": 1e9}),
    far_above_resonance=("A base at thirty times the resonance", {"ratio": 30.0, "dt": 1e-4}),
    far_below_resonance=("A base at a hundredth of the resonance", {"ratio": 0.01, "cycles": 3}),
    million_particles_glued=(
        "A million particles glued to the container",
        {"what": RigidMass(gravity=0.0), "particles": 1_000_000},
    ),
)
def answers_rigidly(trial, _, numbers):
    """{0}: the transfer function."""
    usual = {"what": Empty(), "particles": 0, "cycles": 50, "dt": 1e-3}
    numbers = {**usual, **numbers}
    numbers.update(transient=numbers["cycles"] - 1, cycles=1)
    damper_run.spring(trial, **numbers).rigid_response(TOLERANCE, "transfer function")


def swung(trial, cycles, displacement=0.0, **numbers):
    """Batch of an undamped container on its spring after some cycles, and the last of them."""
    numbers = {"base_amplitude": Y, "damping": 0.0, **numbers}
    batch = Batch(Empty(), SceneTable(0, 1, 1e-3, F, **numbers), mount="spring")
    batch.start("rest", displacement=displacement)
    measured = batch.run(cycles - 1, 1)
    trial.compile_s += batch.compile_seconds
    return batch, measured


@case(["empty"])
def undamped_resonance(trial):
    """No damping, at resonance: it grows by pi y0 a cycle, x = y0 (sin wt - wt cos wt) / 2."""
    cycles = 20 if trial.quick else 500
    batch, _ = swung(trial, cycles)
    found, true = batch.sample()["x"][0], -np.pi * cycles * Y
    trial.limit("error / amplitude", abs(found / true - 1.0), TOLERANCE, "x = -pi n y0")


@case(["empty"])
def free_swing_for_long(trial):
    """An undamped container that is let go swings with the same energy after many cycles."""
    cycles = 100 if trial.quick else 10000
    batch, _ = swung(trial, cycles, 0.01, base_amplitude=0.0)
    state = batch.sample()
    x, v = state["x"][0], state["v"][0]
    energy = (OSCILLATOR.mass * v**2 + K * x**2) / (K * 0.01**2)
    trial.limit("energy error", abs(energy - 1.0), 1e-9 * 50.0 * cycles, "rtol a step")


@case(["empty"])
def nothing_moves_at_all(trial):
    """No base motion, no damping, no particles: it stays, to the bit."""
    batch, measured = swung(trial, 20, base_amplitude=0.0)
    moved = abs(batch.sample()["x"][0]) + measured.rms[0]
    trial.limit("displacement [m]", moved, 0.0, "nothing acts")


@case(["empty"])
def mass_on_a_floor_below_1_g(trial):
    """A mass on a floor that is shaken at 0.9 g does not lift: its sag stays that of 1.9 g."""
    amplitude, heavy = 0.9 * 9.8 / (20.0 * np.pi) ** 2, {"stiffness": 4e5, "damping": 80.0}
    shaken = {"frequency": 10.0, "base_amplitude": amplitude, "dt": 1e-4, **heavy}
    batch = Batch(RigidMass(), SceneTable(0, 1, **shaken), mount="floor", recorded_samples=20000)
    batch.start()
    batch.run(10, 0, record_every=1)
    series = batch.time_series()
    gap = (series["x"] - series["y"])[len(series["x"]) // 2 :, 0]
    sag = M * 9.8 / 4e5
    trial.limit("lift / sag", gap.max() / sag, 0.0, "m (g - A w^2) > 0")
    trial.limit("sag / static", -gap.min() / sag, 2.0, "1.9 g, and 5 % of ringing")


REFUSED = {
    "container_without_mass": ("A container without mass", "mass", {"mass": 0.0}),
    "spring_that_pushes": ("A spring of negative stiffness", "stiffness", {"stiffness": -1.0}),
    "amplitude_without_end": ("Infinite motion", "base_amplitude", {"base_amplitude": np.inf}),
    "half_a_particle": ("Half a particle", "particles", {"particles": 0.5}),
    "seed_below_zero": ("A seed below zero", "seed", {"seed": -1}),
    "cycle_of_few_steps": ("Ten steps a cycle", "dt must lie in", {"dt": 1.0 / 60.0}),
}


def refused(_, question, words, numbers):
    """{0}."""
    table = {"particles": 0, "seed": 1, "dt": 1e-3, "frequency": 6.0, **numbers}
    Batch(Empty(), SceneTable(**table), mount="spring").start()


for name, row in REFUSED.items():
    case((), (["empty"], row[1]), **{name: row})(refused)
