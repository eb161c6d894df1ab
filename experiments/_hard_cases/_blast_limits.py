"""Bounds that several hard cases of the blast share; the formula stands with each."""

import numpy as np

from _hard_cases._blast_scenes import EPS
from _hard_cases._case import Case, Curves, Limit, Measured
from taichi_dem import CONCRETE


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


def eased_pair(track, method, opening, mesh):
    """A pair pulled by an opening [m] eases: momentum kept, no energy gained."""
    area = bond_area(mesh)
    stored = 0.5 * CONCRETE.normal_stiffness * area * opening**2
    own = track.kinetic() - 0.5 * track.mass.sum() * centre_speed2(track)
    # Energy of the own motion is a difference of large ones: their rounding is allowed on top.
    rounding = 1e3 * EPS * float(track.kinetic()[0]) / stored
    limit = Limit(
        "energy of easing / stored", float((own / stored).max()), 1.0 + rounding, "k A u^2 / 2"
    )
    gap = gap_of(track, opening)
    eased = Limit("opening left / first", float(abs(gap[-1] / opening)), 1.0, "dashpots only ease")
    shown = curve_of(track, method, 1e6 * gap, "opening [µm]")
    return Measured((momentum_kept(track), limit, eased), shown, track.compile_s)


def centre_speed2(track):
    """Squared speed of the centre of mass [m^2/s^2], (s,)."""
    return ((track.linear() / track.mass.sum()) ** 2).sum(axis=1)


def gap_of(track, opening):
    """Distance of the pair along x beyond that of the mesh [m]."""
    return opening + track.moved[:, 1, 0] - track.moved[:, 0, 0]


def bond_area(mesh):
    """Area of the face that two bodies share [m^2]."""
    shared = sorted(set(mesh.tetrahedra[0]) & set(mesh.tetrahedra[1]))
    corners = mesh.points[shared]
    return 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))


def blast_case(run, methods, declines=None):
    """A Case of the blast by its function."""
    name = run.__name__
    return Case(name, "blast", run.__doc__.split("\n")[0], tuple(methods), run, declines or {})


def decline(methods, words):
    """Words that are due, for several methods."""
    return dict.fromkeys(methods, words)
