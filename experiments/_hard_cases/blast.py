"""Hard cases of the blast that share runs; the formula of every bound stands with the bound."""

import numpy as np

from _hard_cases import _blast_scenes as scenes
from _hard_cases._blast_limits import (
    ACCURACY,
    as_converged,
    bond_area,
    eased_pair,
    gap_of,
    measured,
    momentum_kept,
    no_energy_made,
    pair_opening,
    touching_until,
)
from _hard_cases._blast_scenes import EPS, OPENING, SPIN, TEARING
from _hard_cases._case import Limit, cases_of
from _hard_cases._references import damped_opening, speed_torn
from taichi_dem import CONCRETE
from taichi_dem.mesh.shapes import pair

FREE = tuple(scenes.FREE)
TOUCHING = tuple(scenes.TOUCHING)
LIMITED = ("limited", "controlled")
_PAIR_TOO_FAST = ("uniform", "multirate_held", "multirate_drifted"), "throw bodies apart"
CASES, case = cases_of("blast")


def but(*unable):
    """All methods of bodies that touch but some."""
    return tuple(method for method in TOUCHING if method not in unable)


def _free_until(quick):
    return 4e-4 if quick else 4e-3


def _spin(axis):
    """Add the case of a turn about one axis."""

    def spin(method, quick):
        track = scenes.loose(method, _free_until(quick))[f"spin_{axis}"]
        energy = track.rotational() / track.rotational()[0]
        momentum = track.motion["angular_momentum"][:, 0]
        kept = np.linalg.norm(momentum - momentum[0], axis=1).max() / np.linalg.norm(momentum[0])
        steps = track.time_s[-1] / track.dt
        # The midpoint rule turns about an axis that is off by (w dt)^2 / 12 at most: the energy,
        # w . L / 2 at a given L, then misses the difference of the principal inertias.
        inertias = np.linalg.eigvalsh(track.inertia[0])
        uneven = (inertias[2] - inertias[0]) / inertias[0]
        bound = (SPIN * track.dt) ** 2 / 12.0 * uneven + steps * EPS
        formula, drift = "(w dt)^2 (I3 - I1) / 12 I1", float(abs(track.moved).max())
        limits = (
            Limit("energy error", float(abs(energy - 1.0).max()), bound, formula),
            Limit("angular momentum error", float(kept), steps * EPS, "n eps: rounding"),
            Limit("drift of the centre [m]", drift, 0.0, "nothing acts"),
        )
        return measured(
            track, method, limits, energy - 1.0, "energy of spin / at the start - 1 [1]"
        )

    spin.__name__ = f"spin_about_{axis}"
    spin.__doc__ = (
        f"An uneven body at 1e4 rad/s about {axis} tumbles and keeps energy and angular momentum."
    )
    case(FREE)(spin)


for one in "xyz":
    _spin(one)


@case(FREE)
def fragment_at_1_km_s(method, quick):
    """A fragment of 1.1 km/s flies straight: position to rounding, velocity to the bit."""
    track = scenes.loose(method, _free_until(quick))["fast"]
    velocity = track.motion["velocity"][:, 0]
    way = velocity[0] * track.time_s[:, None]
    off = float(abs(track.moved[:, 0] - way).max())
    # Every addition rounds the place by half an ulp of the way gone at most.
    steps = track.time_s[-1] / track.dt * 2.0 ** float(track.motion["level"].max())
    bound = 0.5 * steps * EPS * float(abs(track.motion["position"]).max())
    limits = (
        Limit("off its path [m]", off, bound, "n steps x eps / 2 x place"),
        Limit("change of velocity", float(abs(velocity - velocity[0]).max()), 0.0, "same bits"),
    )
    return measured(track, method, limits, track.moved[:, 0, 0], "x [m]")


@case(FREE)
def one_element(method, quick):
    """A single body that nothing acts on stays where it is, to the bit."""
    return _stays(scenes.loose(method, _free_until(quick))["still"], method)


@case(TOUCHING)
def two_elements(method, quick):
    """A bonded pair that nothing acts on stays where it is, to the bit, beside a fast fragment."""
    return _stays(scenes.touching(method, touching_until(quick))["still"], method)


def _stays(track, method):
    moved = Limit("displacement [m]", float(abs(track.moved).max()), 0.0, "nothing acts")
    return measured(track, method, (moved,), abs(track.moved).max(axis=(1, 2)), "displacement [m]")


@case(TOUCHING)
def fragment_hits_block(method, quick):
    """A fragment of 100 m/s hits a resting block at once: no energy, no momentum from nowhere."""
    track = scenes.touching(method, touching_until(quick))["hit"]
    given = float(track.kinetic()[0])
    others = float(abs(track.moved[-1, 1:]).max())
    limits = (
        momentum_kept(track),
        no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("block not reached", float(others == 0.0), 0.0, "it was hit"),
    )
    return measured(track, method, limits, track.kinetic() / given, "kinetic energy / given [1]")


@case(("implicit",), _PAIR_TOO_FAST, (LIMITED, "parts too fast"))
def deep_overlap_at_start(method, quick):
    """Two fragments that begin 1 mm inside each other are pushed apart as their dashpots let them.

    Mirror images: six spheres of either face meet, each overlapped by the 1 mm.
    """
    track = scenes.touching(method, touching_until(quick))["overlap"]
    laws = 6.0 * CONCRETE.contact_stiffness, 6.0 * CONCRETE.contact_damping
    left = damped_opening(0.5 * track.mass[0], *laws, 1e-3, 0.0, track.time_s)
    parted = track.moved[:, 1, 0] - track.moved[:, 0, 0]
    # Up to 1 % of the overlap: later on those that touch at an angle part before the others.
    early, gone = track.time_s < 2.1e-5, 1e-3 - left
    error = as_converged(
        "error of the way apart / way", parted[early], gone[early], gone[early][-1]
    )
    limits = (momentum_kept(track), error)
    return measured(track, method, limits, 1e6 * parted, "distance [µm]")


@case(TOUCHING)
def strained_block_in_flight(method, quick):
    """A pulled pair that flies at 23 m/s keeps its momentum and eases as it would at rest."""
    track = scenes.touching(method, touching_until(quick))["strained"]
    return eased_pair(track, method, OPENING, pair())


@case(TOUCHING)
def coordinates_at_1_km(method, quick):
    """The same pair 1.7 km from the origin moves as at the origin, but for rounding of its place.

    Where a step's way is below the rounding, a body would stand still.
    """
    tracks = scenes.touching(method, touching_until(quick))
    near, far = tracks["strained"], tracks["strained_far"]
    apart = abs(gap_of(near, OPENING) - gap_of(far, OPENING)).max() / OPENING
    steps = near.time_s[-1] / near.dt
    bound = 4.0 * steps * np.spacing(scenes.FAR) / OPENING
    limit = Limit("difference / opening", float(apart), bound, "4 n ulp(1 km) / u")
    limits = (limit, momentum_kept(far))
    return measured(far, method, limits, 1e6 * gap_of(far, OPENING), "opening [µm]")


@case(but(*LIMITED), (LIMITED, "give way too fast"))
def slivers(method, quick):
    """Two slivers of aspect 50 pulled by 1 µm ease as slowly as their dashpots make them."""
    track = scenes.touching(method, touching_until(quick))["sliver"]
    return eased_pair(track, method, 1e-6, pair(0.05, 0.05 / 50))


@case(but("implicit"), (("implicit",), "failed late"))
def zero_gap_on_breakage(method, quick):
    """A pair torn apart at 200 m/s: its spheres appear where they touch, and give nothing."""
    track = scenes.touching(method, touching_until(quick))["torn"]
    given = float(track.kinetic()[0])
    parting = speed_torn(0.5 * track.mass[0], bond_area(pair()), CONCRETE, 2.0 * TEARING)
    left = (0.5 * parting / TEARING) ** 2
    limits = (
        Limit("bonds that held", 1.0 - track.broken, 0.0, "v m / (2 c A) > 30 µm"),
        momentum_kept(track),
        energy_left(track, left, track.mass[0] / 2.0),
    )
    return measured(track, method, limits, track.kinetic() / given, "kinetic energy / given [1]")


@case(TOUCHING)
def four_broken_faces(method, quick):
    """All four neighbours are torn off one body: it stays in the middle, by symmetry."""
    track = scenes.touching(method, touching_until(quick))["four_torn"]
    given = float(track.kinetic()[0])
    parting = speed_torn(track.mass[1], bond_area(pair()), CONCRETE, TEARING)
    left = (parting / TEARING) ** 2
    # Four outward impulses cancel; what is left is the order in which they act.
    drift = np.linalg.norm(track.moved[:, 0], axis=1) / np.linalg.norm(track.moved[-1, 1])
    limits = (
        Limit("bonds that held", 4.0 - track.broken, 0.0, "v m / (2 c A) > 30 µm"),
        momentum_kept(track),
        energy_left(track, left, track.mass[1]),
        Limit("drift of the middle / way of a neighbour", float(drift.max()), 1e-2, "symmetry"),
    )
    return measured(track, method, limits, track.kinetic() / given, "kinetic energy / given [1]")


def energy_left(track, left, mass):
    """Limit of what bodies keep after their bond has torn, late by a step; mass: reduced [kg]."""
    given = track.kinetic()[0]
    rate = 2.0 * CONCRETE.normal_damping * bond_area(pair()) / mass
    late, formula = max(ACCURACY, left * rate * track.dt), "1 %, or torn late by a step"
    name = "error of the energy left / given"
    return as_converged(name, track.kinetic()[-1], left * given, given, late, formula)


@case(TOUCHING)
def bond_crushed(method, quick):
    """A pair pressed together at 10 m/s through its bond is stopped as its dashpots stop it."""
    track = scenes.touching(method, touching_until(quick))["crushed"]
    own = 0.5 * track.mass[0], bond_area(pair())
    true = pair_opening(*own, 0.0, -10.0, track.time_s)
    gap = gap_of(track, 0.0)
    # The first step begins with the dashpots of a step ago, or of half a step where these are
    # solved: the bodies go on for as long at their speed.
    deepest = abs(true).max()
    late = 10.0 * track.dt * (0.5 if method == "implicit" else 1.0)
    late, formula = max(ACCURACY, late / deepest), "1 %, or the start late by v dt"
    error = as_converged("opening error / deepest", gap, true, deepest, late, formula)
    return measured(track, method, (momentum_kept(track), error), 1e6 * gap, "opening [µm]")
