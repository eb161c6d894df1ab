"""Hard cases of the granular damper: what its methods claim to bear, and what they refuse."""

import numpy as np

from _hard_cases import _damper_scenes as scenes
from _hard_cases._case import Curves, Limit, Measured, cases_of
from _hard_cases._damper_scenes import AUTOMATA, EXACT, SPHERES, filling
from ca_damper import Batch, SceneTable, SimulationDiverged

CASES, case = cases_of("damper")
_ALL = (*AUTOMATA, *SPHERES)


def _sound(run, method, *more, shown=None):
    """What always holds, beside what else the case asks for."""
    limits = [scenes.kept_inside(run), *more]
    if method in EXACT:
        limits.append(scenes.momentum_kept(run))
    shown = shown or scenes.energies(run, method)
    return Measured(tuple(limits), shown, run.batch.compile_seconds)


@case(_ALL)
def full_box(method, quick):
    """Every cell taken, shaken at 3.5 g: nothing can move far, nothing may be lost."""
    what = filling(method)
    run = scenes.drive(what, what.capacity, 4 if quick else 40)
    more = [scenes.speed_bounded(run)]
    return _sound(run, method, *more, shown=scenes.places(run, method))


@case(("empty", *_ALL))
def empty_box(method, quick):
    """No particle, at resonance: the transfer function, to RK45's tolerance and its round-off."""
    run = scenes.spring(filling(method), 0, 20 if quick else 1000)
    limit = scenes.rigid_response(run, 1e-8, "10 x rtol of RK45")
    return Measured((limit,), scenes.swings(run, method), run.batch.compile_seconds)


@case(_ALL)
def one_particle(method, quick):
    """One particle, shaken at 3.5 g."""
    run = scenes.drive(filling(method), 1, 20 if quick else 500)
    return _sound(run, method, scenes.speed_bounded(run))


@case((), (_ALL, "particles must"))
def too_many(method, quick):
    """One more than fits."""
    what = filling(method)
    return _sound(scenes.drive(what, what.capacity + 1, 1), method)


@case(("automaton",), (SPHERES, "restitution must lie in"))
def no_rebound(method, quick):
    """Restitution 0: a particle stays where it falls, at less than the speed of what rests."""
    none = {"restitution": 0.0, "wall_restitution": 0.0}
    what = filling(method, automaton={"start": ((5, 15),)}, **none)
    history = scenes.fall(what, 0.4)
    weight = what.particle_mass * what.gravity
    # Heights count to the middle of a cell; the kinetic energy left is at most that at the
    # threshold of static contact, 5 g dt, of m g 15 cells.
    fallen = history["energy"][-1, 0] / (weight * what.width) - 0.5
    bound = 12.5 * what.gravity * what.default_dt**2 / (15.0 * what.width)
    limit = Limit("energy left", float(fallen) / 15.0, bound, "(5 g dt)^2 / (2 g h)")
    return Measured((limit,), _energy_in_time(history, method))


@case(_ALL)
def full_rebound(method, quick):
    """Restitution 1: a particle bounces for ever; energy may err by the lateness of each blow.

    A blow seen up to 1.5 steps late changes the speed v by 1.5 g dt, the energy by 3 g dt / v. The
    leapfrog's energy is off by (w dt)^2 / 24 where a contact, half a period of w, has six steps.
    """
    full = {"restitution": 1.0, "wall_restitution": 1.0}
    start = {"automaton": {"start": ((5, 15),)}, "spheres": {"start": ((0.03, 0.093),)}}
    what = filling(method, **start, **full)
    duration = 1.4 if quick else 14.0
    history = scenes.fall(what, duration)
    energy = history["energy"][:, 0] / history["energy"][0, 0]
    height = 0.09
    blows = 1 + duration / (2.0 * np.sqrt(2.0 * height / what.gravity))
    late = 3.0 * what.gravity * what.default_dt / np.sqrt(2.0 * what.gravity * height)
    bound, formula = blows * late, "3 g dt / v a blow"
    if method in SPHERES:
        bound, formula = blows * (np.pi / 6.0) ** 2 / 24.0, "(w dt)^2 / 24 a blow, w dt = pi / 6"
    limit = Limit("energy error", float(np.abs(energy - 1.0).max()), bound, formula)
    return Measured((limit,), _energy_in_time(history, method))


def _energy_in_time(history, method):
    energy = history["energy"][:, 0]
    lines = {method: (history["time_s"][:, 0], energy / energy[0])}
    return Curves("time [s]", "energy / energy at the start [1]", lines)


@case(_ALL)
def no_gravity(method, quick):
    """Nothing pulls down: the mean force comes from walls alone, and momentum is kept."""
    what = filling(method, gravity=0.0)
    return _sound(scenes.drive(what, 30, 10 if quick else 100), method)


@case(AUTOMATA)
def wall_near_a_cell_a_step(method, quick):
    """The wall takes half a cell a step: what it throws back, (1 + e) V, just fits in one."""
    what, dt = filling(method), 1e-3
    amplitude = 0.5 * what.width / dt / (2.0 * np.pi * 6.0)
    run = scenes.drive(what, 30, 5 if quick else 50, dt=dt, amplitude=amplitude)
    return _sound(run, method)


@case((), (AUTOMATA, "faster than one cell a step"))
def wall_above_a_cell_a_step(method, quick):
    """The wall takes 1.5 cells a step: particles that it pushes skip cells."""
    what, dt = filling(method), 1e-3
    amplitude = 1.5 * 6e-3 / dt / (2.0 * np.pi * 6.0)
    return _sound(scenes.drive(what, 30, 5, dt=dt, amplitude=amplitude), method)


@case(AUTOMATA)
def longest_steps(method, quick):
    """Steps of 1.1 ms, of the 1.2 ms in which the largest speed crosses a cell, shaken at 3.5 g."""
    run = scenes.drive(filling(method), 50, 20 if quick else 200, dt=1.1e-3)
    return _sound(run, method, scenes.speed_bounded(run))


@case((), (AUTOMATA, "dt must lie in"))
def step_above_limit(method, quick):
    """A step in which a particle at the largest speed would cross more than a cell."""
    return _sound(scenes.drive(filling(method), 50, 1, dt=2e-3), method)


@case(SPHERES)
def spheres_near_limit(method, quick):
    """Steps of 30 us, four in a contact, shaken at 2.2 g."""
    run = scenes.drive(filling(method), 30, 5 if quick else 50, dt=3e-5, amplitude=0.015)
    return _sound(run, method, _flight_energy(run))


def _flight_energy(run):
    """Energy of particles that all fly at twice the wall's speed, as high as the box."""
    what, row = run.batch.filling, run.batch.table.row(0)
    wall = 2.0 * np.pi * row["frequency"] * row["base_amplitude"]
    height = what.height if hasattr(what, "height") else what.rows * what.width
    most = run.particles * what.particle_mass * (2.0 * wall**2 + what.gravity * height)
    energy = float(run.column("energy").max())
    return Limit("energy [J]", energy, most, "N m ((2 V)^2 / 2 + g H)")


@case((), (SPHERES, "dt must be at most"))
def spheres_beyond_limit(method, quick):
    """Steps of 0.1 ms: a contact is over before it is seen."""
    run = scenes.drive(filling(method), 30, 3, dt=1e-4, amplitude=0.015)
    return _sound(run, method, _flight_energy(run))


@case((), (("spheres",), "dt must be at most"))
def spheres_that_gain(method, quick):
    """Steps of 40 us, three in a contact: some contacts give back more than they took.

    Named by the account of energy, or by a speed, whichever is seen first.
    """
    run = scenes.drive(filling(method), 50, 5, dt=4e-5, amplitude=0.015)
    return _sound(run, method, _flight_energy(run))


@case(SPHERES)
def advised_step(method, quick):
    """The step that the end of a diverged run advises must do."""
    what = filling(method)
    try:
        scenes.drive(what, 30, 3, dt=1e-4, amplitude=0.015)
    except SimulationDiverged as error:
        run = scenes.drive(what, 30, 5 if quick else 50, dt=error.dt_allowed, amplitude=0.015)
        return _sound(run, method, _flight_energy(run))
    return Measured((Limit("runs that diverged", np.nan, 1.0, "0.1 ms has to diverge"),))


@case(EXACT)
def resonance_for_long(method, quick):
    """Thirty particles at the peak of the damped response, for 1000 cycles.

    The mean force is the weight: what is left is the momentum kept at the ends, over the time.
    """
    cycles = 100 if quick else 1000
    run = scenes.spring(filling(method), 30, cycles, ratio=0.966, transient=40)
    row, what = run.batch.table.row(0), run.batch.filling
    wall = 2.0 * np.pi * row["frequency"] * run.column("x_max").max()
    kept = 4.0 * wall / (what.gravity * cycles / row["frequency"])
    taken = Limit("power given", -float(run.cycles.complex_power[0].real), 0.0, "grains only take")
    weight = scenes.weight_carried(run, kept, "4 V / (g T)")
    return _sound(run, method, weight, taken, shown=scenes.swings(run, method))


@case(EXACT)
def rigid_limit(method, quick):
    """Fifty particles that never lift: those of a structure heavier by N m, to 2e-3."""
    run = scenes.spring(
        filling(method), 50, 20, ratio=0.8, base=0.1e-3, transient=100 if quick else 250
    )
    rigid = scenes.rigid_response(run, 2e-3, "the specification")
    return _sound(run, method, rigid, shown=scenes.swings(run, method))


@case(EXACT)
def heavy_particles(method, quick):
    """Particles ten times as heavy as the container (1 g), never lifting: no added-mass blow-up."""
    what = filling(method)
    # The peak of 51 particles' worth of mass lies at 2.7 f0; 0.8 f0 is far below it.
    run = scenes.spring(what, 50, 20, ratio=0.8, base=0.5e-3, mass=1e-3, transient=100)
    rigid = scenes.rigid_response(run, 2e-3, "the specification")
    return _sound(run, method, rigid, shown=scenes.swings(run, method))


@case(_ALL)
def light_particles(method, quick):
    """Particles of 0.1 mg: the container feels no more of them than their share of its mass."""
    what = filling(method, particle_mass=1e-7)
    # Contacts of light spheres are as much briefer.
    dt = what.safe_step() if method in SPHERES else None
    run = scenes.spring(what, 30, 4 if quick else 40, dt=dt)
    share = 30.0 * 1e-7 / scenes.OSCILLATOR.mass
    quality = 0.5 / scenes.OSCILLATOR.damping_ratio
    bound = 4.0 * quality * share + 1e-8
    limit = scenes.rigid_response(run, bound, "4 Q N m / M")
    return _sound(run, method, limit, shown=scenes.swings(run, method))


@case(_ALL)
def odd_step(method, quick):
    """A step that does not divide the cycle is shortened, never lengthened."""
    asked = 1.37e-4 if method in AUTOMATA else 1.7e-5
    run = scenes.drive(filling(method), 30, 5, dt=asked, frequency=5.777)
    turns = run.dt * 5.777 * int(run.batch.steps_per_cycle[0])
    whole = Limit("cycle error", abs(turns - 1.0), 4.0 * scenes.EPS, "rounding")
    longer = Limit(
        "step beyond the one asked for", max(0.0, run.dt / asked - 1.0), 0.0, "shortened"
    )
    return _sound(run, method, whole, longer)


@case(EXACT)
def still_heap(method, quick):
    """A hundred particles in a container at rest come to rest, and weigh what they weigh."""
    seconds = 1.0 if quick else 10.0
    run = scenes.drive(
        *(filling(method), 100, int(10 * seconds)),
        frequency=10.0,
        amplitude=0.0,
        transient=30,
    )
    weight = scenes.weight_carried(run, 1e-3, "the specification")
    energy = run.column("energy")
    rise = Limit("energy rise", float(np.diff(energy).max() / energy[0]), 1e-6, "nothing moves")
    place = scenes.places(run, method)
    limits = (scenes.kept_inside(run), weight, rise)
    return Measured(limits, place, run.batch.compile_seconds)


@case(_ALL)
def violent_base(method, quick):
    """348 g: the base swings 24 mm at 60 Hz, its walls at 9 m/s."""
    dt = 1e-5 if method in AUTOMATA else 2e-6
    run = scenes.drive(filling(method), 30, 5 if quick else 50, dt=dt, frequency=60.0)
    return _sound(run, method, scenes.speed_bounded(run))


@case(EXACT)
def single_cell(method, quick):
    """A box as large as its one particle: it can only ride along, at 3.5 g as below g."""
    boxed = {"automaton": {"columns": 1, "rows": 1}, "spheres": {"width": 6e-3, "height": 6e-3}}
    what = filling(method, **boxed)
    pressed, thrown = (scenes.drive(what, 1, 20, amplitude=a) for a in (5e-3, 24e-3))
    # A sphere between two walls is a mass on their springs, heavier by (w / W)^2 < 1e-3.
    bound, formula = 2e-3, "the rigid limit of the specification"
    limits = [_mass_error("below g", pressed, bound, formula)]
    if method in AUTOMATA:
        # In free flight it is known to half a cell only, and a square wave of that height has a
        # first harmonic 4 / pi as high.
        bound, formula = 2.0 * what.width / (np.pi * 24e-3), "4 / pi x half a cell / amplitude"
    limits.append(_mass_error("at 3.5 g", thrown, bound, formula))
    return _sound(thrown, method, *limits)


def _mass_error(when, run, bound, formula):
    mass = float(run.cycles.apparent_mass[0] / run.batch.filling.particle_mass)
    return Limit(f"apparent mass error {when}", abs(mass - 1.0), bound, formula)


@case(SPHERES)
def hard_spheres(method, quick):
    """Spheres of steel's modulus run at the step advised for them, a tenth of the soft ones'."""
    what = filling(method, young=2e11, wall_young=2e11)
    cycles = 1 if quick else 3
    run = scenes.drive(what, 30, cycles, dt=what.safe_step(), amplitude=0.015)
    return _sound(run, method, _flight_energy(run))


@case((), (SPHERES, "dt must be at most"))
def hard_spheres_at_long_step(method, quick):
    """Spheres of steel's modulus at the step of the soft ones."""
    what = filling(method, young=2e11, wall_young=2e11)
    run = scenes.drive(what, 30, 3, amplitude=0.015)
    return _sound(run, method, _flight_energy(run))


@case(SPHERES)
def rough_spheres(method, quick):
    """Friction 1000: nothing chatters, energy of a still heap falls to rest."""
    what = filling(method, friction=1e3, wall_friction=1e3)
    history = scenes.fall(what, 1.0 if quick else 3.0, particles=60)
    energy = history["energy"][:, 0] / history["energy"][0, 0]
    rise = Limit("energy rise", float(np.diff(energy).max()), 0.01, "the specification")
    return Measured((rise,), _energy_in_time(history, method))


@case((), (_ALL, "frequency must"))
def infinite_numbers(method, quick):
    """A frequency that is no number."""
    batch = Batch(filling(method), SceneTable(30, 1, 1e-4, np.nan, 0.024), mount="base")
    batch.start()
    return Measured((Limit("runs", np.nan, 0.0, "there is no such cycle"),))
