"""Hard cases of the granular damper: what its methods claim to bear, and what they refuse."""

import numpy as np

from ca_damper import Batch, SceneTable, SimulationDiverged
from ca_damper.plot.boxes import BoxSize
from cases.hard import Cases, damper_run
from cases.hard.damper_run import ALL, AUTOMATA, EXACT, SPHERES, drive, fall, filling, spring

case = CASES = Cases("damper")
#: An amplitude [m] at which spheres are shaken at 2.2 g.
MILD = 0.015
#: Options of particles whose blows give back a share of the speed.
FULL, NONE = ({"restitution": e, "wall_restitution": e} for e in (1.0, 0.0))
STEEL = {"young": 2e11, "wall_young": 2e11}


@case(ALL)
def full_box(trial):
    """Every cell taken, shaken at 3.5 g: nothing can move far, nothing may be lost."""
    what = filling(trial)
    run = drive(trial, what, what.capacity, 4 if trial.quick else 40)
    run.speed_bounded()


@case(("empty", *ALL))
def empty_box(trial):
    """No particle, at resonance: the transfer function, to RK45's tolerance and its round-off."""
    run = spring(trial, filling(trial), 0, 20 if trial.quick else 1000)
    run.rigid_response(1e-8, "10 x rtol of RK45")


@case(ALL)
def one_particle(trial):
    """One particle, shaken at 3.5 g."""
    drive(trial, filling(trial), 1, 20 if trial.quick else 500).speed_bounded()


@case((), (ALL, "particles must"))
def too_many(trial):
    """One more than fits."""
    drive(trial, filling(trial), filling(trial).capacity + 1, 1)


@case(["automaton"], (SPHERES, "restitution must be"))
def no_rebound(trial):
    """Restitution 0: a particle stays where it falls, at less than the speed of what rests."""
    what = filling(trial, automaton={"start": ((5, 15),)}, **NONE)
    # Heights count to the middle of a cell; the kinetic energy left is at most that at the
    # threshold of static contact, 5 g dt, of m g 15 cells.
    energy = fall(trial, what, 0.4)[-1] / (what.particle_mass * what.gravity * what.width) - 0.5
    bound = 12.5 * what.gravity * what.default_dt**2 / (15.0 * what.width)
    trial.limit("energy left", energy / 15.0, bound, "(5 g dt)^2 / (2 g h)")


@case(ALL)
def full_rebound(trial):
    """Restitution 1: a particle bounces for ever; energy may err by the lateness of each blow.

    A blow seen up to 1.5 steps late changes the speed v by 1.5 g dt, the energy by 3 g dt / v. The
    leapfrog's energy is off by (w dt)^2 / 24 where a contact, half a period of w, has six steps.
    """
    start = {"automaton": {"start": ((5, 15),)}, "spheres": {"start": ((0.03, 0.093),)}}
    what = filling(trial, **start, **FULL)
    duration, speed = 1.4 if trial.quick else 14.0, np.sqrt(2.0 * what.gravity * 0.09)
    error, formula = 3.0 * what.gravity * what.default_dt / speed, "3 g dt / v a blow"
    if trial.method in SPHERES:
        error, formula = (np.pi / 6.0) ** 2 / 24.0, "(w dt)^2 / 24 a blow, w dt = pi / 6"
    energy = fall(trial, what, duration)
    bound = error * (1.0 + 0.5 * duration * what.gravity / speed)
    trial.limit("energy error", abs(energy / energy[0] - 1.0), bound, formula)


@case(ALL)
def no_gravity(trial):
    """Nothing pulls down: the mean force comes from walls alone, and momentum is kept."""
    drive(trial, filling(trial, gravity=0.0), 30, 10 if trial.quick else 100)


@case(AUTOMATA, wall_near_a_cell_a_step=(0.5, 50))
@case((), (AUTOMATA, "faster than one cell a step"), wall_above_a_cell_a_step=(1.5, 5))
def push(trial, cells, cycles):
    """The wall takes {0:g} cells a step and throws back (1 + e) V: more than one skips cells."""
    amplitude = cells * filling(trial).width / 1e-3 / (2.0 * np.pi * 6.0)
    cycles = 5 if trial.quick else cycles
    drive(trial, filling(trial), 30, cycles, base_amplitude=amplitude, dt=1e-3)


@case(AUTOMATA)
def longest_steps(trial):
    """Steps of 1.1 ms, of the 1.2 ms in which the largest speed crosses a cell, shaken at 3.5 g."""
    drive(trial, filling(trial), 50, 20 if trial.quick else 200, dt=1.1e-3).speed_bounded()


@case((), (AUTOMATA, "dt must lie in"))
def step_above_limit(trial):
    """A step in which a particle at the largest speed would cross more than a cell."""
    drive(trial, filling(trial), 50, 1, dt=2e-3)


def mild(trial, cycles=3, what=None, particles=30, **options):
    """Spheres shaken at 2.2 g."""
    what = what or filling(trial)
    run = drive(trial, what, particles, cycles, base_amplitude=MILD, **options)
    # All fly at twice the wall's speed, as high as the box.
    most = run.mass * (2.0 * (run.omega * MILD) ** 2 + what.gravity * BoxSize.of(what).height)
    trial.limit("energy [J]", run.column("energy"), most, "N m ((2 V)^2 / 2 + g H)")


@case(SPHERES)
def spheres_near_limit(trial):
    """Steps of 30 us, four in a contact, shaken at 2.2 g."""
    mild(trial, 5 if trial.quick else 50, dt=3e-5)


@case((), (SPHERES, "dt must be at most"))
def spheres_beyond_limit(trial):
    """Steps of 0.1 ms: a contact is over before it is seen."""
    mild(trial, dt=1e-4)


@case((), (["spheres"], "dt must be at most"))
def spheres_that_gain(trial):
    """Steps of 42 us, three in a contact: some contacts give back more than they took.

    Named by the account of energy, or by a speed, whichever is seen first. At 40 us three of eight
    seeds do so, at 42 us all of them.
    """
    mild(trial, 5, particles=50, dt=4.2e-5)


@case(SPHERES)
def advised_step(trial):
    """The step that the end of a diverged run advises must do."""
    try:
        mild(trial, dt=1e-4)
    except SimulationDiverged as error:
        trial.limits.clear()
        mild(trial, 5 if trial.quick else 50, dt=error.dt_allowed)
    else:
        trial.limit("runs that diverged", np.nan, 1.0, "0.1 ms has to diverge")


@case(EXACT)
def resonance_for_long(trial):
    """Thirty particles at the peak of the damped response, for 1000 cycles.

    The mean force is the weight: what is left is the momentum kept at the ends, over the time.
    """
    cycles = 100 if trial.quick else 1000
    run = spring(trial, filling(trial), 30, cycles, ratio=0.966, transient=40)
    run.sound()
    wall = run.omega * run.column("x_max").max()
    run.weight_carried(4.0 * wall / (run.what.gravity * run.time), "4 V / (g T)")
    trial.limit("power given", -run.cycles.complex_power[0].real, 0.0, "grains only take")


def below_lift_off(trial, particles, cycles, *limit, what=None, **options):
    """Particles that never lift answer as a mass glued to the container."""
    run = spring(trial, what or filling(trial), particles, cycles, **options)
    run.sound()
    run.rigid_response(*limit or (2e-3, "the specification"))


@case(EXACT)
def rigid_limit(trial):
    """Fifty particles that never lift: those of a structure heavier by N m, to 2e-3."""
    transient = 100 if trial.quick else 250
    below_lift_off(trial, 50, 20, ratio=0.8, base=0.1e-3, transient=transient)


@case(EXACT)
def heavy_particles(trial):
    """Particles ten times as heavy as the container (1 g), never lifting: no added-mass blow-up."""
    # The peak of 51 particles' worth of mass lies at 2.7 f0; 0.8 f0 is far below it.
    below_lift_off(trial, 50, 20, ratio=0.8, base=0.5e-3, mass=1e-3, transient=100)


@case(ALL)
def light_particles(trial):
    """Particles of 0.1 mg: the container feels no more of them than their share of its mass."""
    what = filling(trial, particle_mass=1e-7)
    # Contacts of light spheres are as much briefer.
    dt = what.safe_step() if trial.method in SPHERES else what.default_dt
    empty, cycles = damper_run.OSCILLATOR, 4 if trial.quick else 40
    quality, share = 0.5 / empty.damping_ratio, 30.0 * 1e-7 / empty.mass
    limit = 4.0 * quality * share + 1e-8, "4 Q N m / M"
    below_lift_off(trial, 30, cycles, *limit, what=what, dt=dt)


@case(ALL)
def odd_step(trial):
    """A step that does not divide the cycle is shortened, never lengthened."""
    asked = 1.37e-4 if trial.method in AUTOMATA else 1.7e-5
    run = drive(trial, filling(trial), 30, 5, dt=asked, frequency=5.777)
    turns, longer = run.row["dt"] * 5.777 * run.steps, max(0.0, run.row["dt"] / asked - 1.0)
    trial.limit("cycle error", abs(turns - 1.0), 4.0 * np.spacing(1.0), "rounding")
    trial.limit("step beyond the one asked for", longer, 0.0, "shortened")


@case(EXACT)
def still_heap(trial):
    """A hundred particles in a container at rest come to rest, and weigh what they weigh."""
    options = {"frequency": 10.0, "base_amplitude": 0.0, "transient": 30}
    run = damper_run.Run(trial, filling(trial), 100, 10 if trial.quick else 100, **options)
    run.kept_inside()
    run.weight_carried(1e-3, "the specification")
    energy = run.column("energy")
    trial.limit("energy rise", np.diff(energy) / energy[0], 1e-6, "nothing moves")


@case(ALL)
def violent_base(trial):
    """348 g: the base swings 24 mm at 60 Hz, its walls at 9 m/s."""
    dt, cycles = 1e-5 if trial.method in AUTOMATA else 2e-6, 5 if trial.quick else 50
    drive(trial, filling(trial), 30, cycles, dt=dt, frequency=60.0).speed_bounded()


@case(EXACT)
def single_cell(trial):
    """A box as large as its one particle: it can only ride along, at 3.5 g as below g."""
    boxed = {"automaton": {"columns": 1, "rows": 1}, "spheres": {"width": 6e-3, "height": 6e-3}}
    what = filling(trial, **boxed)
    # A sphere between two walls is a mass on their springs, heavier by (w / W)^2 < 1e-3.
    bounds = [(2e-3, "the rigid limit of the specification")] * 2
    if trial.method in AUTOMATA:
        # In free flight it is known to half a cell only, and a square wave of that height has a
        # first harmonic 4 / pi as high.
        bounds[1] = 2.0 * what.width / (np.pi * 24e-3), "4 / pi x half a cell / amplitude"
    for when, amplitude, limit in zip(("below g", "at 3.5 g"), (5e-3, 24e-3), bounds):
        run = damper_run.Run(trial, what, 1, 20, base_amplitude=amplitude)
        mass = run.cycles.apparent_mass[0] / what.particle_mass
        trial.limit(f"apparent mass error {when}", abs(mass - 1.0), *limit)
    run.sound()


@case(SPHERES)
def hard_spheres(trial):
    """Spheres of steel's modulus run at the step advised for them, a tenth of the soft ones'."""
    what = filling(trial, **STEEL)
    mild(trial, 1 if trial.quick else 3, what, dt=what.safe_step())


@case((), (SPHERES, "dt must be at most"))
def hard_spheres_at_long_step(trial):
    """Spheres of steel's modulus at the step of the soft ones."""
    mild(trial, what=filling(trial, **STEEL))


@case(SPHERES)
def rough_spheres(trial):
    """Friction 1000: nothing chatters, energy of a still heap falls to rest."""
    what = filling(trial, friction=1e3, wall_friction=1e3)
    energy = fall(trial, what, 1.0 if trial.quick else 3.0, particles=60)
    trial.limit("energy rise", np.diff(energy / energy[0]), 0.01, "the specification")


@case((), (ALL, "frequency must"))
def infinite_numbers(trial):
    """A frequency that is no number."""
    Batch(filling(trial), SceneTable(30, 1, 1e-4, np.nan, 0.024), mount="base").start()
