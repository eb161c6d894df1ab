"""Hard cases of the blast that share runs; the formula of every bound stands with the bound."""

import numpy as np

from _hard_cases import _blast_scenes as scenes
from _hard_cases._blast_limits import (
    blast_case,
    bond_area,
    curve_of,
    eased_pair,
    gap_of,
    momentum_kept,
    no_energy_made,
    touching_until,
)
from _hard_cases._blast_scenes import EPS, OPENING, SPIN
from _hard_cases._case import Limit, Measured
from taichi_dem import CONCRETE
from taichi_dem.mesh_shapes import pair

FREE = tuple(scenes.FREE)


TOUCHING = tuple(scenes.TOUCHING)


def _free_until(quick):
    return 4e-4 if quick else 4e-3


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
    return Measured(limits, curve_of(track, method, energy, "energy of spin"), track.compile_s)


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
    shown = curve_of(track, method, track.moved[:, 0, 0], "x [m]")
    return Measured(limits, shown, track.compile_s)


def one_element(method, quick):
    """A single body that nothing acts on stays where it is, to the bit."""
    return _stays(scenes.loose(method, _free_until(quick))["still"], method)


def two_elements(method, quick):
    """A bonded pair that nothing acts on stays where it is, to the bit, beside a fast fragment."""
    return _stays(scenes.touching(method, touching_until(quick))["still"], method)


def _stays(track, method):
    moved = Limit("displacement [m]", float(abs(track.moved).max()), 0.0, "nothing acts")
    shown = curve_of(track, method, abs(track.moved).max(axis=(1, 2)), "displacement [m]")
    return Measured((moved,), shown, track.compile_s)


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
    shown = curve_of(track, method, track.kinetic() / given, "kinetic energy / given")
    return Measured(limits, shown, track.compile_s)


def deep_overlap_at_start(method, quick):
    """Two fragments that begin 1 mm inside each other part with no more than the springs held."""
    track = scenes.touching(method, touching_until(quick))["overlap"]
    # Mirror images: six spheres of either face meet, each overlapped by the 1 mm.
    given = 6 * 0.5 * CONCRETE.contact_stiffness * 1e-3**2
    limits = (momentum_kept(track), no_energy_made(track, given, 0.0, "6 k d^2 / 2"))
    parted = track.moved[:, 1, 0] - track.moved[:, 0, 0]
    apart = Limit("not pushed apart", float(parted[-1] <= 0.0), 0.0, "springs only repel")
    shown = curve_of(track, method, track.kinetic() / given, "kinetic / stored at the start")
    return Measured((*limits, apart), shown, track.compile_s)


def strained_block_in_flight(method, quick):
    """A pulled pair that flies at 23 m/s keeps its momentum and eases without gain of energy."""
    track = scenes.touching(method, touching_until(quick))["strained"]
    return eased_pair(track, method, OPENING, pair())


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
    shown = curve_of(far, method, 1e6 * gap_of(far, OPENING), "opening [µm]")
    return Measured((limit, momentum_kept(far)), shown, far.compile_s)


def slivers(method, quick):
    """Two slivers of aspect 50 pulled by 1 µm ease and make no energy."""
    track = scenes.touching(method, touching_until(quick))["sliver"]
    return eased_pair(track, method, 1e-6, pair(0.05, 0.05 / 50))


def zero_gap_on_breakage(method, quick):
    """A pair torn apart at 200 m/s: its spheres appear where they touch, and give nothing."""
    track = scenes.touching(method, touching_until(quick))["torn"]
    given = float(track.kinetic()[0])
    limits = (
        Limit("bonds that held", 1.0 - track.broken, 0.0, "v m / (2 c A) > 30 µm"),
        momentum_kept(track),
        no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
    )
    shown = curve_of(track, method, track.kinetic() / given, "kinetic energy / given")
    return Measured(limits, shown, track.compile_s)


def four_broken_faces(method, quick):
    """All four neighbours are torn off one body: it stays in the middle, by symmetry."""
    track = scenes.touching(method, touching_until(quick))["four_torn"]
    given = float(track.kinetic()[0])
    # Four outward impulses cancel; what is left is the order in which they act.
    drift = np.linalg.norm(track.moved[:, 0], axis=1) / np.linalg.norm(track.moved[-1, 1])
    limits = (
        Limit("bonds that held", 4.0 - track.broken, 0.0, "v m / (2 c A) > 30 µm"),
        momentum_kept(track),
        no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("drift of the middle / way of a neighbour", float(drift.max()), 1e-2, "symmetry"),
    )
    shown = curve_of(track, method, track.kinetic() / given, "kinetic energy / given")
    return Measured(limits, shown, track.compile_s)


def bond_crushed(method, quick):
    """A pair pressed together at 10 m/s through its bond bounces with less than it had."""
    track = scenes.touching(method, touching_until(quick))["crushed"]
    given = float(track.kinetic()[0])
    gap = gap_of(track, 0.0)
    limits = (
        momentum_kept(track),
        no_energy_made(track, given, 1e-3, "kinetic <= kinetic at the start"),
        Limit("pressed in / m v^2 alone", _deepest(gap, track, given), 1.0, "k A u^2 / 2 <= E"),
    )
    return Measured(limits, curve_of(track, method, 1e6 * gap, "opening [µm]"), track.compile_s)


def _deepest(gap, track, given):
    """Deepest closing of the bond over that at which its spring alone holds all energy."""
    alone = (2.0 * given / (CONCRETE.normal_stiffness * bond_area(pair()))) ** 0.5
    return float(-gap.min() / alone)


CASES = (
    blast_case(spin_about_x, FREE),
    blast_case(spin_about_y, FREE),
    blast_case(spin_about_z, FREE),
    blast_case(fragment_at_1_km_s, FREE),
    blast_case(one_element, FREE),
    blast_case(two_elements, TOUCHING),
    blast_case(fragment_hits_block, TOUCHING),
    blast_case(deep_overlap_at_start, TOUCHING),
    blast_case(strained_block_in_flight, TOUCHING),
    blast_case(coordinates_at_1_km, TOUCHING),
    blast_case(slivers, TOUCHING),
    blast_case(zero_gap_on_breakage, TOUCHING),
    blast_case(four_broken_faces, TOUCHING),
    blast_case(bond_crushed, TOUCHING),
)
