"""Hard cases of the blast with a run of their own, and what has to be refused."""

from dataclasses import replace

import numpy as np

from _demo import set_moving
from _hard_cases import _blast_scenes as scenes
from _hard_cases._blast_limits import (
    as_converged,
    eased_pair,
    measured,
    momentum_kept,
    no_energy_made,
    touching_until,
)
from _hard_cases._blast_scenes import FAST, OPENING
from _hard_cases._case import Curves, Limit, Measured, cases_of
from _hard_cases._references import eased_pair_shift, static_sag, stopped_speed
from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
)
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.topology import body_properties, faces_of_group

CASES, case = cases_of("blast")
_BASIC = ("uniform", "multirate_held", "implicit")
JUMPING = {
    "controlled": Multirate(8e-8, 5e-9, control=StepControl(level_jump=None)),
    "multirate_held": Multirate(8e-8, 5e-9),
}
#: Bond springs bear 1.6e-8 s here: 100 times as stiff as the shear springs make them elsewhere.
STIFF = {"uniform": Uniform(1e-8), "implicit": ImplicitDashpots(1e-8)}
STANDING = {
    "uniform": Uniform(2e-8),
    "multirate_held": Multirate(2e-8, 1e-7),
    "implicit": ImplicitDashpots(4e-7),
}
TOO_LONG = {
    "uniform": Uniform(1e-6),
    "multirate_held": Multirate(1e-6, 1e-3),
    "implicit": ImplicitDashpots(2e-5),
}


@case(tuple(JUMPING))
def jump_of_ten_levels(method, quick):
    """A fragment of 100 m/s hits a block whose bodies sleep ten levels above its own."""
    island = scenes.fragment_and_block()
    way = JUMPING[method]
    track = scenes.follow({"only": island}, scenes.contact_effects(), way, 1e-5)["only"]
    given = float(track.kinetic()[0])
    level = track.motion["level"][0]
    jump = max(1, int(level[0] - level[1:].min()))
    limits = (
        momentum_kept(track),
        no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("10 / jump at the start", 10.0 / jump, 1.0, "log2(v dt0 / l)"),
    )
    return measured(track, method, limits, track.kinetic() / given, "kinetic energy / given [1]")


@case(("implicit",), (("limited", "controlled"), "parts too fast"))
def mass_ratio_1e4(method, quick):
    """A body of 3.5 mg meets one of 35 g at 1 m/s: dashpots stop the point that meets."""
    small = single(0.05 * 1e-4 ** (1.0 / 3.0))
    large = checked_mesh(pair().points[[0, 1, 2, 4]], [[3, 0, 2, 1]], {})
    # The spheres stand behind the faces, so that two of them have to be aimed at each other.
    points = [scenes.sphere_on_base(one) for one in (small, large)]
    motion = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    place = points[1] - points[0] - [1e-7, 0.0, 0.0]
    island = scenes.Island.of((small, place), (large, 0.0), velocity=motion)
    way = {**scenes.TOUCHING, "limited": Uniform(4e-9, dashpot="limited")}[method]
    # The exact solution knows one contact; later the small body has turned, and others meet.
    track = _alone(island, way, 2e-5)
    centres = [body_properties(one, CONCRETE.density)[1][0] for one in (small, large)]
    arms = [point - centre for point, centre in zip(points, centres)]
    x = np.array([1.0, 0.0, 0.0])
    true = stopped_speed(small, CONCRETE, large, arms, x, x)
    speed = track.motion["velocity"][:, 0]
    error = as_converged("velocity error / speed", speed[-1], true, 1.0)
    limits = (momentum_kept(track), error)
    return measured(track, method, limits, speed[:, 0], "speed [m/s]")


def _alone(island, way, until, material=CONCRETE, acting=None):
    """Track of one island in a run of its own."""
    acting = scenes.contact_effects() if acting is None else acting
    made = scenes.follow({"only": island}, acting, way, until, material)
    return made["only"]


@case(("controlled", "implicit"))
def damping_ratio_300(method, quick):
    """Contacts damped 300 times critical bring two bodies to one speed, and never to throw back."""
    other = checked_mesh(pair().points[[0, 1, 2, 4]], [[3, 0, 2, 1]], {})
    motion = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    island = scenes.Island.of((single(), (-1e-7, 0.0, 0.0)), (other, 0.0), velocity=motion)
    reduced = 0.5 * 2390.0 * 0.05**3 / (6.0 * 2.0**0.5)
    damping = 300.0 * 2.0 * (reduced * CONCRETE.contact_stiffness) ** 0.5
    material = replace(CONCRETE, contact_damping=damping)
    track = _alone(island, scenes.TOUCHING[method], touching_until(quick), material)
    speed = track.motion["velocity"][:, :, 0]
    # The springs hold v^2 / (4 zeta^2) of the energy at most, and give it back in c / k = 12 ms.
    error = as_converged("speed error / first", speed[-1], 0.5, 1.0, formula="1 % of one speed")
    return measured(track, method, (momentum_kept(track), error), speed[:, 0], "speed [m/s]")


@case(tuple(STIFF))
def stiffness_ratio_1e4(method, quick):
    """Bonds 1e4 times stiffer in the normal than in shear: a sheared pair eases as it must."""
    material = replace(CONCRETE, normal_stiffness=1e4 * CONCRETE.shear_stiffness)
    shift = [0.0, 5e-6, 0.0]
    acting = [effects.BondDamping()]
    island = scenes.Island.of((pair(), 0.0), shift=[[0.0, 0.0, 0.0], shift])
    track = _alone(island, STIFF[method], 1e-4, material, acting)
    left = shift + track.moved[:, 1] - track.moved[:, 0]
    true = eased_pair_shift(pair(), material, shift, track.time_s)
    error = as_converged("error of the slide / first", left, true, shift[1])
    return measured(track, method, (momentum_kept(track), error), 1e6 * left[:, 1], "slide [µm]")


@case(tuple(STANDING))
def many_steps_at_rest(method, quick):
    """A million steps of a column on a fixed foot under its weight: it comes to rest, and stays.

    Where it has to come to rest is solved for directly.
    """
    mesh, weight = bar(0.2, 0.1, (2, 1, 1)), (-9.81, 0.0, 0.0)
    acting = [effects.BondDamping(), effects.Gravity(weight), effects.Fixed("left")]
    way = STANDING[method]
    simulation = Simulation(Scene(mesh, CONCRETE, acting), way)
    steps = 40000 if quick else 1000000
    samples = scenes.march(simulation, steps * way.dt0)
    sag = samples["motion"]["position"][:, :, 0] - simulation.model.centre[:, 0]
    top = simulation.model.topology
    fixed = np.zeros(mesh.body_count, dtype=bool)
    fixed[faces_of_group(mesh, top, "left")[0]] = True
    static = static_sag(mesh, CONCRETE, weight, fixed)[:, 0]
    speed = np.linalg.norm(samples["motion"]["velocity"][-1], axis=1).max()
    settling = CONCRETE.shear_damping / CONCRETE.shear_stiffness
    limits = (
        as_converged("error of the sag / sag", sag[-1], static, abs(static).max()),
        Limit("way still to go / sag", settling * speed / abs(static).max(), 0.01, "v c / k"),
    )
    shown = Curves("time [µs]", "sag [nm]", {method: (1e6 * samples["time_s"], 1e9 * sag.min(1))})
    return Measured(limits, shown, simulation.compile_seconds)


@case(("multirate_held", "controlled", "implicit"))
def sudden_pressure_on_sleepers(method, quick):
    """Full pressure within 10 ns on bodies at rest: momentum is the pressure's to rounding."""
    mesh = bar(0.2, 0.1, (2, 1, 1))
    gas = effects.GasPressure(group="left", peak=100e6, rise=1e-8, decay_ratio=1e7)
    acting = [effects.BondDamping(), effects.Softening(), effects.ShearSlip(), gas]
    way = {**scenes.FREE, "multirate_held": Multirate(1e-8, 1e-7)}[method]
    simulation = Simulation(Scene(mesh, CONCRETE, acting), way)
    until = touching_until(quick)
    samples = scenes.march(simulation, until)
    report = simulation.report()
    speed = samples["motion"]["velocity"]
    impulse = np.einsum("n,sn->s", simulation.model.body_mass, speed[:, :, 0])
    given = 100e6 * 0.1**2 * samples["time_s"][-1]
    late = 2.0 * way.dt0 / until + 1e-8 / until
    limits = (
        Limit("impulse error", abs(impulse[-1] / given - 1.0), late, "(2 dt + rise) / t"),
        Limit("momentum error", report.linear_momentum_error, 1e-12, "rounding"),
        Limit("energy from nowhere", report.energy_residual_fraction, 0.05, "the specification"),
    )
    shown = Curves("time [µs]", "impulse [N s]", {method: (1e6 * samples["time_s"], impulse)})
    return Measured(limits, shown, simulation.compile_seconds)


@case((), (_BASIC, "diverged at"))
def step_beyond_all_limits(method, quick):
    """A step far above the limits, which the run has to say."""
    island = scenes.Island.of((pair(), 0.0), shift=[[0.0, 0.0, 0.0], [OPENING, 0.0, 0.0]])
    acting = [effects.BondDamping()]
    track = scenes.follow({"only": island}, acting, TOO_LONG[method], 1e-3)["only"]
    return eased_pair(track, method, OPENING, pair())


@case((), (("uniform",), "moves at"))
def faster_than_the_bound(method, quick):
    """A body beyond the speed at which a scene counts as run away."""
    simulation = Simulation(Scene(single(), CONCRETE, max_speed=100.0), scenes.FREE[method])
    set_moving(simulation, [[FAST, 0.0, 0.0]])
    return _never(lambda: scenes.march(simulation, 1e-5))


@case((), (("uniform",), "volume"))
def flat_element(method, quick):
    """Four points in one plane are no body."""
    return _never(
        lambda: checked_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2, 3]], {})
    )


@case((), (("uniform",), "face"))
def face_of_three(method, quick):
    """A face between three bodies is no bond."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 1]]
    return _never(lambda: checked_mesh(points, [[0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]], {}))


@case((), (("uniform",), "points"))
def points_at_one_place(method, quick):
    """Two bodies that share a place but no points look joined, and are not."""
    points = np.vstack([single().points, single().points])
    return _never(lambda: checked_mesh(points, [[0, 1, 2, 3], [4, 5, 6, 7]], {}))


@case((), (_BASIC, "positive finite"))
def step_that_is_no_number(method, quick):
    """A step that is no number."""
    made = {"implicit": ImplicitDashpots, "uniform": Uniform, "multirate_held": Multirate}
    return _never(lambda: made[method](float("nan")))


@case((), (("uniform",), "fracture_energy"))
def strength_beyond_stiffness(method, quick):
    """A bond whose fracture energy is spent before it reaches its strength."""
    return _never(lambda: replace(CONCRETE, fracture_energy=1.0))


def _never(work):
    """Do work that has to be refused."""
    work()
    return Measured((Limit("was not refused", np.nan, 0.0, "there is nothing to compute"),))
