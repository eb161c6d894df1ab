"""Hard cases of the blast; the formula of every bound stands with the bound."""

from dataclasses import replace

import numpy as np

from _hard_cases import _blast_scenes as scenes
from _hard_cases._blast_scenes import EPS, FAST, OPENING, SPIN
from _hard_cases._case import Case, Curves, Limit, Measured
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
from taichi_dem.mesh import checked_mesh
from taichi_dem.mesh_shapes import bar, pair, single

FREE = tuple(scenes.FREE)
TOUCHING = tuple(scenes.TOUCHING)
SHORT = ("limited", "controlled", "implicit")


def _free_until(quick):
    return 4e-4 if quick else 4e-3


def _touching_until(quick):
    return 2e-5 if quick else 1e-4


def _curve(track, method, y, ylabel, bounds=()):
    return Curves("time [µs]", ylabel, {method: (1e6 * track.time_s, y)}, bounds)


def _momentum(track):
    """Pair impulses cancel bit for bit; sums of them round, and so does every body's place."""
    steps = max(1.0, track.time_s[-1] / track.dt)
    place = float(abs(track.motion["position"]).max()) / 0.05
    bound = EPS * (100.0 * steps**0.5 + steps * place)
    formula = "100 eps sqrt(n) + n eps place / size"
    return Limit("momentum error", track.momentum_error(), bound, formula)


def _no_energy_made(track, given, allowed, formula):
    """Kinetic energy never exceeds what there was at the start."""
    rise = float((track.kinetic() / given).max() - 1.0)
    return Limit("kinetic energy above what was there", rise, allowed, formula)


def _spin(axis, method, quick):
    track = scenes.loose(method, _free_until(quick))[f"spin_{axis}"]
    energy = track.rotational() / track.rotational()[0]
    momentum = track.motion["angular_momentum"][:, 0]
    kept = np.linalg.norm(momentum - momentum[0], axis=1).max() / np.linalg.norm(momentum[0])
    # First order: a step turns the body by w dt about an axis that is off by as much.
    bound = 4.0 * SPIN * track.dt
    steps = track.time_s[-1] / track.dt
    limits = (
        Limit("energy error", float(abs(energy - 1.0).max()), bound, "4 w dt, first order"),
        Limit("angular momentum error", float(kept), steps * EPS, "n eps: rounding"),
        Limit("drift of the centre [m]", float(abs(track.moved).max()), 0.0, "nothing acts"),
    )
    return Measured(limits, _curve(track, method, energy, "energy of spin"), track.compile_s)


def spin_about_x(method, quick):
    """An uneven body at 1e4 rad/s about x tumbles and keeps energy and angular momentum."""
    return _spin("x", method, quick)


def spin_about_y(method, quick):
    """An uneven body at 1e4 rad/s about y tumbles and keeps energy and angular momentum."""
    return _spin("y", method, quick)


def spin_about_z(method, quick):
    """An uneven body at 1e4 rad/s about z tumbles and keeps energy and angular momentum."""
    return _spin("z", method, quick)


def fragment_at_1_km_s(method, quick):
    """A fragment of 1.1 km/s flies straight: position to rounding, velocity to the bit."""
    track = scenes.loose(method, _free_until(quick))["fast"]
    velocity = track.motion["velocity"][:, 0]
    way = velocity[0] * track.time_s[:, None]
    off = float(abs(track.moved[:, 0] - way).max())
    # Every addition rounds the place by half an ulp of the way gone at most.
    steps = track.time_s[-1] / track.dt * 2.0**8
    bound = steps * EPS * float(abs(track.motion["position"]).max())
    limits = (
        Limit("off its path [m]", off, bound, "256 n steps x eps x place"),
        Limit("change of velocity", float(abs(velocity - velocity[0]).max()), 0.0, "same bits"),
    )
    shown = _curve(track, method, track.moved[:, 0, 0], "x [m]")
    return Measured(limits, shown, track.compile_s)


def one_element(method, quick):
    """A single body that nothing acts on stays where it is, to the bit."""
    return _stays(scenes.loose(method, _free_until(quick))["still"], method)


def two_elements(method, quick):
    """A bonded pair that nothing acts on stays where it is, to the bit, beside a fast fragment."""
    return _stays(scenes.touching(method, _touching_until(quick))["still"], method)


def _stays(track, method):
    moved = Limit("displacement [m]", float(abs(track.moved).max()), 0.0, "nothing acts")
    shown = _curve(track, method, abs(track.moved).max(axis=(1, 2)), "displacement [m]")
    return Measured((moved,), shown, track.compile_s)


def fragment_hits_block(method, quick):
    """A fragment of 100 m/s hits a resting block at once: no energy, no momentum from nowhere."""
    track = scenes.touching(method, _touching_until(quick))["hit"]
    given = float(track.kinetic()[0])
    others = float(abs(track.moved[-1, 1:]).max())
    limits = (
        _momentum(track),
        _no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("block not reached", float(others == 0.0), 0.0, "it was hit"),
    )
    shown = _curve(track, method, track.kinetic() / given, "kinetic energy / given")
    return Measured(limits, shown, track.compile_s)


JUMPING = {
    "controlled": Multirate(8e-8, 5e-9, control=StepControl(level_jump=None)),
    "multirate_held": Multirate(8e-8, 5e-9),
}


def jump_of_ten_levels(method, quick):
    """A fragment of 100 m/s hits a block whose bodies sleep ten levels above its own."""
    island = scenes.fragment_and_block()
    way = JUMPING[method]
    track = scenes.follow({"only": island}, scenes.contact_effects(), way, 1e-5)["only"]
    given = float(track.kinetic()[0])
    level = track.motion["level"][0]
    jump = max(1, int(level[0] - level[1:].min()))
    limits = (
        _momentum(track),
        _no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("10 / jump at the start", 10.0 / jump, 1.0, "log2(v dt0 / l)"),
    )
    shown = _curve(track, method, track.kinetic() / given, "kinetic energy / given")
    return Measured(limits, shown, track.compile_s)


def deep_overlap_at_start(method, quick):
    """Two fragments that begin 1 mm inside each other part with no more than the springs held."""
    track = scenes.touching(method, _touching_until(quick))["overlap"]
    # Mirror images: six spheres of either face meet, each overlapped by the 1 mm.
    given = 6 * 0.5 * CONCRETE.contact_stiffness * 1e-3**2
    limits = (_momentum(track), _no_energy_made(track, given, 0.0, "6 k d^2 / 2"))
    parted = track.moved[:, 1, 0] - track.moved[:, 0, 0]
    apart = Limit("not pushed apart", float(parted[-1] <= 0.0), 0.0, "springs only repel")
    shown = _curve(track, method, track.kinetic() / given, "kinetic / stored at the start")
    return Measured((*limits, apart), shown, track.compile_s)


def strained_block_in_flight(method, quick):
    """A pulled pair that flies at 23 m/s keeps its momentum and eases without gain of energy."""
    track = scenes.touching(method, _touching_until(quick))["strained"]
    return _strained(track, method, OPENING, pair())


def _strained(track, method, opening, mesh):
    area = _bond_area(mesh)
    stored = 0.5 * CONCRETE.normal_stiffness * area * opening**2
    own = track.kinetic() - 0.5 * track.mass.sum() * _centre_speed2(track)
    # Energy of the own motion is a difference of large ones: their rounding is allowed on top.
    rounding = 1e3 * EPS * float(track.kinetic()[0]) / stored
    limit = Limit(
        "energy of easing / stored", float((own / stored).max()), 1.0 + rounding, "k A u^2 / 2"
    )
    gap = _gap(track, opening)
    eased = Limit("opening left / first", float(abs(gap[-1] / opening)), 1.0, "dashpots only ease")
    shown = _curve(track, method, 1e6 * gap, "opening [µm]")
    return Measured((_momentum(track), limit, eased), shown, track.compile_s)


def _centre_speed2(track):
    return ((track.linear() / track.mass.sum()) ** 2).sum(axis=1)


def _gap(track, opening):
    """Distance of the pair along x beyond that of the mesh [m]."""
    return opening + track.moved[:, 1, 0] - track.moved[:, 0, 0]


def _bond_area(mesh):
    shared = sorted(set(mesh.tetrahedra[0]) & set(mesh.tetrahedra[1]))
    corners = mesh.points[shared]
    return 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))


def coordinates_at_1_km(method, quick):
    """The same pair 1.7 km from the origin moves as at the origin, but for rounding of its place.

    Where a step's way is below the rounding, a body would stand still.
    """
    tracks = scenes.touching(method, _touching_until(quick))
    near, far = tracks["strained"], tracks["strained_far"]
    apart = abs(_gap(near, OPENING) - _gap(far, OPENING)).max() / OPENING
    steps = near.time_s[-1] / near.dt
    bound = 4.0 * steps * np.spacing(scenes.FAR) / OPENING
    limit = Limit("difference / opening", float(apart), bound, "4 n ulp(1 km) / u")
    shown = _curve(far, method, 1e6 * _gap(far, OPENING), "opening [µm]")
    return Measured((limit, _momentum(far)), shown, far.compile_s)


def slivers(method, quick):
    """Two slivers of aspect 50 pulled by 1 µm ease and make no energy."""
    track = scenes.touching(method, _touching_until(quick))["sliver"]
    return _strained(track, method, 1e-6, pair(0.05, 0.05 / 50))


def zero_gap_on_breakage(method, quick):
    """A pair torn apart at 200 m/s: its spheres appear where they touch, and give nothing."""
    track = scenes.touching(method, _touching_until(quick))["torn"]
    given = float(track.kinetic()[0])
    limits = (
        Limit("bonds that held", 1.0 - track.broken, 0.0, "v m / (2 c A) > 30 µm"),
        _momentum(track),
        _no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
    )
    shown = _curve(track, method, track.kinetic() / given, "kinetic energy / given")
    return Measured(limits, shown, track.compile_s)


def four_broken_faces(method, quick):
    """All four neighbours are torn off one body: it stays in the middle, by symmetry."""
    track = scenes.touching(method, _touching_until(quick))["four_torn"]
    given = float(track.kinetic()[0])
    # Four outward impulses cancel; what is left is the order in which they act.
    drift = np.linalg.norm(track.moved[:, 0], axis=1) / np.linalg.norm(track.moved[-1, 1])
    limits = (
        Limit("bonds that held", 4.0 - track.broken, 0.0, "v m / (2 c A) > 30 µm"),
        _momentum(track),
        _no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("drift of the middle / way of a neighbour", float(drift.max()), 1e-2, "symmetry"),
    )
    shown = _curve(track, method, track.kinetic() / given, "kinetic energy / given")
    return Measured(limits, shown, track.compile_s)


def bond_crushed(method, quick):
    """A pair pressed together at 10 m/s through its bond bounces with less than it had."""
    track = scenes.touching(method, _touching_until(quick))["crushed"]
    given = float(track.kinetic()[0])
    gap = _gap(track, 0.0)
    limits = (
        _momentum(track),
        _no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("pressed in / m v^2 alone", _deepest(gap, track, given), 1.0, "k A u^2 / 2 <= E"),
    )
    return Measured(limits, _curve(track, method, 1e6 * gap, "opening [µm]"), track.compile_s)


def _deepest(gap, track, given):
    """Deepest closing of the bond over that at which its spring alone holds all energy."""
    alone = (2.0 * given / (CONCRETE.normal_stiffness * _bond_area(pair()))) ** 0.5
    return float(-gap.min() / alone)


def mass_ratio_1e4(method, quick):
    """A body of 3.5 mg meets one of 35 g at 1 m/s: it is thrown back at no more than it came."""
    small = single(0.05 * 1e-4 ** (1.0 / 3.0))
    large = checked_mesh(pair().points[[0, 1, 2, 4]], [[3, 0, 2, 1]], {})
    # The spheres stand behind the faces, so that two of them have to be aimed at each other.
    aim = scenes.sphere_on_base(large) - scenes.sphere_on_base(small)
    motion = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    island = scenes.Island.of((small, aim - [1e-7, 0.0, 0.0]), (large, 0.0), velocity=motion)
    way = {**scenes.TOUCHING, "limited": Uniform(4e-9, dashpot="limited")}[method]
    track = _alone(island, way, _touching_until(quick))
    return _meeting(track, method)


def _alone(island, way, until, material=CONCRETE, acting=None):
    """Track of one island in a run of its own."""
    acting = scenes.contact_effects() if acting is None else acting
    made = scenes.follow({"only": island}, acting, way, until, material)
    return made["only"]


def _meeting(track, method):
    given = float(track.kinetic()[0])
    limits = (_momentum(track), _no_energy_made(track, given, 1e-3, "kinetic <= at the start"))
    speed = track.motion["velocity"][:, 0, 0]
    slowed = Limit("speed after / before", float(abs(speed[-1])), 1.0 - 1e-3, "it met the other")
    return Measured((*limits, slowed), _curve(track, method, speed, "speed [m/s]"), track.compile_s)


def damping_ratio_300(method, quick):
    """Contacts damped 300 times critical bring two bodies to one speed, and never to throw back."""
    other = checked_mesh(pair().points[[0, 1, 2, 4]], [[3, 0, 2, 1]], {})
    motion = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    island = scenes.Island.of((single(), (-1e-7, 0.0, 0.0)), (other, 0.0), velocity=motion)
    reduced = 0.5 * 2390.0 * 0.05**3 / (6.0 * 2.0**0.5)
    damping = 300.0 * 2.0 * (reduced * CONCRETE.contact_stiffness) ** 0.5
    material = replace(CONCRETE, contact_damping=damping)
    return _meeting(
        _alone(island, scenes.TOUCHING[method], _touching_until(quick), material), method
    )


def stiffness_ratio_1e4(method, quick):
    """Bonds 1e4 times stiffer in the normal than in shear: a sheared pair eases without gain."""
    material = replace(CONCRETE, shear_stiffness=CONCRETE.normal_stiffness / 1e4)
    slide = 1e-5
    shift = [[0.0, 0.0, 0.0], [0.0, slide, 0.0]]
    acting = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    island = scenes.Island.of((pair(), 0.0), shift=shift)
    track = _alone(island, scenes.TOUCHING[method], _touching_until(quick), material, acting)
    given = 0.5 * material.shear_stiffness * _bond_area(pair()) * slide**2
    limits = (_momentum(track), _no_energy_made(track, given, 0.0, "k_t A s^2 / 2"))
    left = slide + track.moved[:, 1, 1] - track.moved[:, 0, 1]
    eased = Limit(
        "slide left / first", float(abs(left[1:]).max() / slide), 1.0, "dashpots only ease"
    )
    shown = _curve(track, method, 1e6 * left, "slide [µm]")
    return Measured((*limits, eased), shown, track.compile_s)


STANDING = {
    "uniform": Uniform(2e-8),
    "multirate_held": Multirate(2e-8, 1e-7),
    "implicit": ImplicitDashpots(4e-7),
}


def many_steps_at_rest(method, quick):
    """A million steps of a column on a fixed foot under its weight: it sags by no more than twice.

    Twice the static sag is what a load that sets in at once reaches without any damping.
    """
    mesh = bar(0.2, 0.1, (2, 1, 1))
    weight = effects.Gravity((-9.81, 0.0, 0.0))
    acting = [effects.BondDamping(), weight, effects.Fixed("left")]
    way = STANDING[method]
    simulation = Simulation(Scene(mesh, CONCRETE, acting), way)
    steps = 20000 if quick else 1000000
    samples = scenes.march(simulation, steps * way.dt0)
    sag = samples["motion"]["position"][:, :, 0] - simulation.model.centre[:, 0]
    # Bonds in series up the column, at most three a box, each bears the weight above it.
    static = 6 * 2390.0 * 9.81 * 0.2 / CONCRETE.normal_stiffness
    kinetic = (
        0.5 * simulation.model.body_mass @ (samples["motion"]["velocity"][-1] ** 2).sum(axis=1)
    )
    fallen = simulation.model.body_mass.sum() * 9.81 * static
    limits = (
        Limit("sag / static", float(-sag.min() / static), 2.0, "6 rho g h / k_n, twice"),
        Limit("rise / static", float(sag.max() / static), 0.1, "weight pulls down"),
        Limit("kinetic energy / weight x sag", float(kinetic / fallen), 1.0, "all that fell"),
    )
    shown = Curves("time [µs]", "sag [nm]", {method: (1e6 * samples["time_s"], 1e9 * sag.min(1))})
    return Measured(limits, shown, simulation.compile_seconds)


def sudden_pressure_on_sleepers(method, quick):
    """Full pressure within 10 ns on bodies at rest: momentum is the pressure's to rounding."""
    mesh = bar(0.2, 0.1, (2, 1, 1))
    gas = effects.GasPressure(group="left", peak=100e6, rise=1e-8, decay_ratio=1e5)
    acting = [effects.BondDamping(), effects.Softening(), effects.ShearSlip(), gas]
    way = {**scenes.FREE, "multirate_held": Multirate(1e-8, 1e-7)}[method]
    simulation = Simulation(Scene(mesh, CONCRETE, acting), way)
    until = _touching_until(quick)
    samples = scenes.march(simulation, until)
    report = simulation.report()
    speed = samples["motion"]["velocity"]
    impulse = np.einsum("n,sn->s", simulation.model.body_mass, speed[:, :, 0])
    given = 100e6 * 0.1**2 * samples["time_s"][-1]
    late = 2.0 * way.dt0 / until + 1e-8 / until
    limits = (
        Limit("impulse error", abs(impulse[-1] / given - 1.0), late, "(2 dt + rise) / t"),
        Limit("momentum error", report.linear_momentum_error, 1e-12, "rounding"),
        Limit("energy from nowhere", report.ledger_residual_fraction, 0.05, "the specification"),
    )
    shown = Curves("time [µs]", "impulse [N s]", {method: (1e6 * samples["time_s"], impulse)})
    return Measured(limits, shown, simulation.compile_seconds)


TOO_LONG = {
    "uniform": Uniform(1e-6),
    "multirate_held": Multirate(1e-6, 1e-3),
    "implicit": ImplicitDashpots(2e-5),
}


def step_beyond_all_limits(method, quick):
    """A step far above the limits, which the run has to say."""
    island = scenes.Island.of((pair(), 0.0), shift=[[0.0, 0.0, 0.0], [OPENING, 0.0, 0.0]])
    acting = [effects.BondDamping()]
    track = scenes.follow({"only": island}, acting, TOO_LONG[method], 1e-3)["only"]
    return _strained(track, method, OPENING, pair())


def flat_element(method, quick):
    """Four points in one plane are no body."""
    checked_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2, 3]], {})
    return _never()


def face_of_three(method, quick):
    """A face between three bodies is no bond."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 1]]
    checked_mesh(points, [[0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]], {})
    return _never()


def points_at_one_place(method, quick):
    """Two bodies that share a place but no points look joined, and are not."""
    points = np.vstack([single().points, single().points])
    checked_mesh(points, [[0, 1, 2, 3], [4, 5, 6, 7]], {})
    return _never()


def step_that_is_no_number(method, quick):
    """A step that is no number."""
    made = {"implicit": ImplicitDashpots, "uniform": Uniform, "multirate_held": Multirate}
    made[method](float("nan"))
    return _never()


def strength_beyond_stiffness(method, quick):
    """A bond whose fracture energy is spent before it reaches its strength."""
    replace(CONCRETE, fracture_energy=1.0)
    return _never()


def faster_than_the_bound(method, quick):
    """A body beyond the speed at which a scene counts as run away."""
    simulation = Simulation(Scene(single(), CONCRETE, max_speed=100.0), scenes.FREE[method])
    still = [[1.0, 0.0, 0.0, 0.0]]
    simulation.state.place(simulation.model.centre, still, [[FAST, 0.0, 0.0]])
    scenes.march(simulation, 1e-5)
    return _never()


def _never():
    return Measured((Limit("was not refused", np.nan, 0.0, "there is nothing to compute"),))


def _case(run, methods, declines=None):
    name = run.__name__
    return Case(name, "blast", run.__doc__.split("\n")[0], tuple(methods), run, declines or {})


def _decline(methods, words):
    return dict.fromkeys(methods, words)


_BASIC = ("uniform", "multirate_held", "implicit")

CASES = (
    _case(spin_about_x, FREE),
    _case(spin_about_y, FREE),
    _case(spin_about_z, FREE),
    _case(fragment_at_1_km_s, FREE),
    _case(one_element, FREE),
    _case(two_elements, TOUCHING),
    _case(fragment_hits_block, TOUCHING),
    _case(jump_of_ten_levels, tuple(JUMPING)),
    _case(deep_overlap_at_start, TOUCHING),
    _case(strained_block_in_flight, TOUCHING),
    _case(coordinates_at_1_km, TOUCHING),
    _case(slivers, TOUCHING),
    _case(zero_gap_on_breakage, TOUCHING),
    _case(four_broken_faces, TOUCHING),
    _case(bond_crushed, TOUCHING),
    _case(mass_ratio_1e4, SHORT),
    _case(damping_ratio_300, ("controlled", "implicit")),
    _case(stiffness_ratio_1e4, ("limited", "implicit")),
    _case(many_steps_at_rest, tuple(STANDING)),
    _case(sudden_pressure_on_sleepers, ("multirate_held", "controlled", "implicit")),
    _case(step_beyond_all_limits, (), _decline(_BASIC, "diverged at")),
    _case(faster_than_the_bound, (), _decline(("uniform",), "moves at")),
    _case(flat_element, (), _decline(("uniform",), "volume")),
    _case(face_of_three, (), _decline(("uniform",), "face")),
    _case(points_at_one_place, (), _decline(("uniform",), "points")),
    _case(step_that_is_no_number, (), _decline(_BASIC, "positive finite")),
    _case(strength_beyond_stiffness, (), _decline(("uniform",), "fracture_energy")),
)
