"""Hard cases of the blast: free bodies, bonds and supports; a formula stands with every bound."""

from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from cases.closed_forms import LinearBonds
from cases.hard import Cases
from cases.hard.blast_run import ACCURACY, AREA, EPS, FREE, TOUCHING, Run, X, apart
from cases.meshes import with_neighbours
from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, StepControl, Uniform, effects
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.mesh.topology import faces_of_group, topology_of

case = CASES = Cases("blast")
LIMITED = ("limited", "controlled")
UNEVEN, SPIN = [[0, 0, 0], [0.06, 0, 0], [0.01, 0.05, 0], [0.01, 0.01, 0.04]], 1e4
OPENING = 5e-6
PULLED_IN_FLIGHT = {"shift": apart(OPENING), "velocity": (20.0, -10.0, 5.0)}
#: A bond's dashpots alone stop a pair of bodies of 35 g after 0.7 us: 30 um need 43 m/s at least.
TEARING = 100.0
#: Bond springs bear 1.6e-8 s here: 100 times as stiff as the shear springs make them elsewhere.
STIFF = {"uniform": Uniform(1e-8), "implicit": ImplicitDashpots(1e-8)}
BASIC = ("uniform", "multirate_held", "implicit")
STANDING = dict(zip(BASIC, (Uniform(2e-8), Multirate(2e-8, 1e-7), ImplicitDashpots(4e-7))))
TOO_LONG = dict(zip(BASIC, (Uniform(1e-6), Multirate(1e-6, 1e-3), ImplicitDashpots(2e-5))))
#: Edges of the scan [m]: frequency times largest step runs through a factor of four.
SCAN = np.geomspace(0.02, 0.32, 16)
#: Height of the light neighbour over that of the others.
LIGHT = 0.06
#: Largest step times the fastest frequency: of the paper's rule well below the limit of the
#: springs, and beyond the first resonance, pi, which step control has to avoid by itself.
BELOW, BEYOND = 0.3, 4.0
MULTIRATE = ("multirate_drifted", "multirate_held")


def free(trial, mesh, **motion):
    """Run of bodies that no force acts on."""
    return Run(trial, mesh, 4e-4 if trial.quick else 4e-3, methods=FREE, effects=(), **motion)


@case(FREE, spin_about_x=(0, "x"), spin_about_y=(1, "y"), spin_about_z=(2, "z"))
def spin(trial, axis, _):
    """An uneven body at 1e4 rad/s about {1} tumbles and keeps energy and angular momentum."""
    run = free(trial, checked_mesh(UNEVEN, [[0, 1, 2, 3]], {}), spin=SPIN * np.eye(3)[axis])
    energy = run.rotational_energy / run.rotational_energy[0]
    momentum = run["angular_momentum"][:, 0]
    kept = np.linalg.norm(momentum - momentum[0], axis=1) / np.linalg.norm(momentum[0])
    # The midpoint rule turns about an axis that is off by (w dt)^2 / 12 at most: the energy,
    # w . L / 2 at a given L, then misses the difference of the principal inertias.
    inertias = np.linalg.eigvalsh(run.inertia[0])
    uneven = (inertias[2] - inertias[0]) / inertias[0]
    bound = (SPIN * run.dt) ** 2 / 12.0 * uneven + run.steps * EPS
    trial.limit("energy error", abs(energy - 1.0), bound, "(w dt)^2 (I3 - I1) / 12 I1")
    trial.limit("angular momentum error", kept, run.steps * EPS, "n eps: rounding")
    trial.limit("drift of the centre [m]", abs(run.moved), 0.0, "nothing acts")


@case(FREE)
def fragment_at_1_km_s(trial):
    """A fragment of 1.1 km/s flies straight: position to rounding, velocity to the bit."""
    run = free(trial, single(), velocity=(1000.0, -500.0, 0.0))
    run.flies_straight()
    change = abs(run["velocity"] - run["velocity"][0])
    trial.limit("change of velocity", change, 0.0, "same bits")


@case(FREE)
def one_element(trial):
    """A single body that nothing acts on stays where it is, to the bit."""
    free(trial, single()).stays()


@case(TOUCHING)
def two_elements(trial):
    """A bonded pair that nothing acts on stays where it is, to the bit, beside a fast fragment."""
    mesh = placed_together({"pair": (pair(), 0.0 * X), "fragment": (single(), (0.0, 0.0, 1.0))})
    Run(trial, mesh, velocity=[0.0 * X, 0.0 * X, 100.0 * X], bodies=slice(2)).stays()


@case(TOUCHING)
def strained_block_in_flight(trial):
    """A pulled pair that flies at 23 m/s keeps its momentum and eases as it would at rest."""
    run = Run(trial, pair(), **PULLED_IN_FLIGHT)
    run.momentum_kept()
    run.eases(OPENING)


@case(TOUCHING)
def coordinates_at_1_km(trial):
    """The same pair 1.7 km from the origin moves as at the origin, but for rounding of its place.

    Where a step's way is below the rounding, a body would stand still.
    """
    meshes = (placed_together({"pair": (pair(), np.full(3, x))}) for x in (0.0, 1e3))
    near, far = (Run(trial, mesh, **PULLED_IN_FLIGHT) for mesh in meshes)
    gap = abs(near.gap(OPENING) - far.gap(OPENING)) / OPENING
    bound = 4.0 * near.steps * np.spacing(1e3) / OPENING
    trial.limit("difference / opening", gap, bound, "4 n ulp(1 km) / u")
    far.momentum_kept()


@case([name for name in TOUCHING if name not in LIMITED], (LIMITED, "yield too fast"))
def slivers(trial):
    """Two slivers of aspect 50 pulled by 1 µm ease as slowly as their dashpots make them."""
    # A unit of the sliver bears no more than this before it softens.
    run = Run(trial, pair(0.05, 0.05 / 50), shift=apart(1e-6))
    run.momentum_kept()
    run.eases(1e-6)


def speed_torn(mass, speed):
    """Speed [m/s] at which bodies part that are torn off at a speed; mass: reduced [kg].

    m v' = -A (c v + traction of the softening law), up to the failure opening.
    """
    strength, failure = CONCRETE.tensile_strength, CONCRETE.failure_opening
    law = (0.0, strength / CONCRETE.normal_stiffness, failure), (0.0, strength, 0.0)

    def slope(opening, v):
        return -AREA / mass * (CONCRETE.normal_damping + np.interp(opening, *law) / v)

    return solve_ivp(slope, (0.0, failure), [speed], rtol=1e-9, max_step=0.01 * failure).y[0, -1]


def torn(run, bonds, mass, speed):
    """All bonds have failed, and took no more than their law says, late by a step."""
    run.trial.limit("bonds that held", bonds - run.broken, 0.0, "v m / (2 c A) > 30 µm")
    run.momentum_kept()
    left = (speed_torn(mass, speed) / speed) ** 2
    late = max(ACCURACY, left * 2.0 * CONCRETE.normal_damping * AREA / mass * run.dt)
    formula = "1 %, or torn late by a step"
    run.converged("error of the energy left / given", run.energy()[-1], left, 1.0, late, formula)


@case([name for name in TOUCHING if name != "implicit"], (["implicit"], "failed late"))
def zero_gap_on_breakage(trial):
    """A pair torn apart at 200 m/s: its faces touch as they are set free, and give nothing."""
    run = Run(trial, pair(), velocity=[-TEARING * X, TEARING * X])
    torn(run, 1, 0.5 * run.mass[0], 2.0 * TEARING)


@case(TOUCHING)
def four_broken_faces(trial):
    """All four neighbours are torn off one body: it stays in the middle, by symmetry."""
    mesh, outward = with_neighbours(0.05, dict.fromkeys(range(4), 1.0))
    run = Run(trial, mesh, velocity=[np.zeros(3), *TEARING * outward])
    torn(run, 4, run.mass[1], TEARING)
    # Four outward impulses cancel; what is left is the order in which they act.
    drift = np.linalg.norm(run.moved[:, 0], axis=1) / np.linalg.norm(run.moved[-1, 1])
    trial.limit("drift of the middle / way of a neighbour", drift, 1e-2, "symmetry")


@case(TOUCHING)
def bond_crushed(trial):
    """A pair pressed together at 10 m/s through its bond is stopped as its dashpots stop it."""
    run = Run(trial, pair(), velocity=[5.0 * X, -5.0 * X])
    true = run.exact_gap(0.0, -10.0)
    deepest = abs(true).max()
    # The first step begins with the dashpots of a step ago, or of half a step where these are
    # solved: the bodies go on for as long at their speed.
    late = 10.0 * run.dt * (0.5 if trial.method == "implicit" else 1.0)
    bounds = max(ACCURACY, late / deepest), "1 %, or the start late by v dt"
    run.momentum_kept()
    run.converged("opening error / deepest", run.gap(), true, deepest, *bounds)


@case(STIFF)
def stiffness_ratio_1e4(trial):
    """Bonds 1e4 times stiffer in the normal than in shear: a sheared pair eases as it must."""
    material = replace(CONCRETE, normal_stiffness=1e4 * CONCRETE.shear_stiffness)
    laws = {"effects": [effects.BondDamping()], "material": material, "methods": STIFF}
    shift = np.array([[0.0, 0.0, 0.0], [0.0, 5e-6, 0.0]])
    run = Run(trial, pair(), 1e-4, shift=shift, **laws)
    left = shift[1] + run.moved[:, 1] - run.moved[:, 0]
    # Displacements and turns of both bodies, then their rates.
    matrix, start = LinearBonds(pair(), material).state_matrix(), np.zeros(24)
    start[6:9] = shift[1]
    states = np.array([expm(time * matrix) @ start for time in run.time_s])
    run.momentum_kept()
    run.converged("error of the slide / first", left, states[:, 6:9] - states[:, :3], 5e-6)


@case(STANDING)
def many_steps_at_rest(trial):
    """A million steps of a column on a fixed foot under its weight: it comes to rest, and stays.

    Where it has to come to rest is solved for directly.
    """
    mesh, weight = bar(0.2, 0.1, (2, 1, 1)), (-9.81, 0.0, 0.0)
    acting = [effects.BondDamping(), effects.Gravity(weight), effects.Fixed("left")]
    until = STANDING[trial.method].dt0 * (40000 if trial.quick else 1000000)
    run = Run(trial, mesh, until, methods=STANDING, effects=acting)
    fixed = np.isin(range(mesh.body_count), faces_of_group(mesh, topology_of(mesh), "left")[0])
    static = LinearBonds(mesh, CONCRETE).static_displacement(weight, fixed)[:, 0]
    sag, scale = run.moved[:, :, 0], abs(static).max()
    speed = np.linalg.norm(run["velocity"][-1], axis=1).max()
    settling = CONCRETE.shear_damping / CONCRETE.shear_stiffness
    run.converged("error of the sag / sag", sag[-1], static, scale)
    trial.limit("way still to go / sag", settling * speed / scale, 0.01, "v c / k")


@case((), (TOO_LONG, "diverged at"))
def step_beyond_all_limits(trial):
    """A step far above the limits, which the run has to say."""
    acting = [effects.BondDamping()]
    Run(trial, pair(), 1e-3, methods=TOO_LONG, effects=acting, shift=apart(OPENING))


@case(("controlled", *MULTIRATE))
def step_ratio_resonance(trial):
    """Undamped trios swing while their bodies step at 1 to 16 to one another: nothing is gained."""
    scan(trial, BEYOND if trial.method == "controlled" else BELOW)


@case((), (MULTIRATE, "energy are unexplained"))
def step_ratio_beyond_resonance(trial):
    """The same at largest steps up to 1.3 times half a period of the light body."""
    scan(trial, BEYOND)


def scan(trial, ratio):
    """Trios from edges of 2 to 32 cm; ratio: largest step times fastest frequency."""
    # sqrt(k A / m) of the smallest trio's light body, a pyramid of mass rho A h / 3.
    height = LIGHT * SCAN[0] * np.sqrt(2.0 / 3.0)
    dt0 = ratio / np.sqrt(3.0 * CONCRETE.normal_stiffness / (CONCRETE.density * height))
    neighbour = "drifted" if trial.method == "multirate_drifted" else "held"
    control = StepControl() if trial.method == "controlled" else None
    motion = {"methods": {trial.method: Multirate(dt0, 0.05 * dt0, neighbour, control=control)}}
    motion["velocity"] = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.05, 0.0]]
    until, heights = (500 if trial.quick else 20000) * dt0, {0: LIGHT, 1: 1.0}
    meshes = (with_neighbours(edge, heights)[0] for edge in SCAN)
    runs = [Run(trial, mesh, until, effects=(), **motion) for mesh in meshes]
    gain = [run.energy().max() - 1.0 for run in runs[::-1]]
    jump = max(np.ptp(run["level"], axis=1).max() for run in runs)
    # An explicit step of w dt makes the energy beat by (w dt)^2 / 4.
    trial.limit("kinetic energy / given - 1", gain, 0.25 * BELOW**2, "(w dt)^2 / 4")
    trial.limit("3 / levels between neighbours", 3.0 / max(1.0, jump), 1.0, "steps differ")
