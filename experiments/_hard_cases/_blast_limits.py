"""Bounds that several hard cases of the blast share; the formula stands with each."""

import numpy as np

from _hard_cases._blast_scenes import EPS
from _hard_cases._case import Curves, Limit, Measured
from _hard_cases._references import damped_opening
from taichi_dem import CONCRETE

#: By how much a method that claims a case may miss what it has to converge to, as a share.
ACCURACY = 0.01


def touching_until(quick):
    """Time of cases with contact [s]."""
    return 2e-5 if quick else 1e-4


def curve_of(track, method, y, ylabel, bounds=()):
    """What to draw of a track: y over time."""
    return Curves("time [µs]", ylabel, {method: (1e6 * track.time_s, y)}, bounds)


def momentum_kept(track):
    """Pair impulses cancel bit for bit; sums of them round, and so does every body's place."""
    steps = max(1.0, track.time_s[-1] / track.dt)
    place = float(abs(track.motion["position"]).max()) / 0.05
    bound = EPS * (100.0 * steps**0.5 + steps * place)
    formula = "100 eps sqrt(n) + n eps place / size"
    return Limit("momentum error", track.momentum_error(), bound, formula)


def no_energy_made(track, given, allowed, formula):
    """Kinetic energy never exceeds what there was at the start."""
    rise = float((track.kinetic() / given).max() - 1.0)
    return Limit("kinetic energy above what was there", rise, allowed, formula)


def measured(track, method, limits, y, ylabel):
    """What a track gave: its limits, y over time to draw, and what its run itself warns of."""
    shown = curve_of(track, method, y, ylabel)
    return Measured(tuple(limits), shown, track.compile_s, track.warnings)


def as_converged(name, found, true, scale, allowed=ACCURACY, formula="1 % of the exact solution"):
    """Largest distance of what a method found from what it has to converge to, over a scale."""
    apart = float(np.abs(np.asarray(found) - true).max() / scale)
    return Limit(name, apart, allowed, formula)


def eased_pair(track, method, opening, mesh):
    """A pair pulled by an opening [m] eases as the overdamped oscillator that it is."""
    own = 0.5 * track.mass[0], bond_area(mesh)
    true = pair_opening(*own, opening, 0.0, track.time_s)
    gap = gap_of(track, opening)
    error = as_converged("error of the opening / first", gap, true, opening)
    return measured(track, method, (momentum_kept(track), error), 1e6 * gap, "opening [µm]")


def pair_opening(mass, area, opening, speed, time_s):
    """``damped_opening`` of a bonded pair of concrete, mass: reduced [kg], area: of the bond."""
    laws = area * CONCRETE.normal_stiffness, area * CONCRETE.normal_damping
    return damped_opening(mass, *laws, opening, speed, time_s)


def gap_of(track, opening):
    """Distance of the pair along x beyond that of the mesh [m]."""
    return opening + track.moved[:, 1, 0] - track.moved[:, 0, 0]


def bond_area(mesh):
    """Area of the face that two bodies share [m^2]."""
    shared = sorted(set(mesh.tetrahedra[0]) & set(mesh.tetrahedra[1]))
    corners = mesh.points[shared]
    return 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
