"""A crack in a notched plate forks (Borden and others, 2012)."""

import warnings
from typing import NamedTuple

import numpy as np

from cases.trust import Number
from cases.trust.plates import material_of, plate, springs_step
from taichi_dem import ImplicitDashpots, Scene, effects, simulate
from taichi_dem.mesh.mesh import with_cut

#: E [Pa], nu and density [kg/m3].
YOUNG, POISSON, DENSITY = 32e9, 0.2, 2450.0
SOURCE = "Borden et al., CMAME 217 (2012) 77"
#: Plate whose crack forks: length, height, notch [m], and pull on both long edges [Pa]. From 2 MPa
#: on both edges on, their waves meet beyond the strength, and it opens along its middle at once.
LENGTH, HEIGHT, NOTCH, PULL, LOW_PULL = 0.1, 0.04, 0.05, 1e6, 0.5e6
#: Fracture energy of its bonds [J/m2], half of the publication's: by the paper's laws a crack takes
#: about twice as much over its plane. Strength [Pa], of which the publication has none.
ENERGY, STRENGTH = 1.5, 3e6
#: Time [s], and the limit of the speed of cracks, 0.6 of Rayleigh's waves [m/s].
TIME, LIMIT = 80e-6, 1275.0
#: Edges of elements [m], coarse first.
FINE_EDGES = 2.8e-3, 2e-3, 1.4e-3
LIMITED = "elements are not small against the zone in which bonds soften, a few millimetres"
#: Way over which a speed is measured, and distance of two branches, both in edges.
WAY, APART = 10.0, 3.0


class Crack(NamedTuple):
    """Bonds that broke ahead of the notch: places (n, 2) [m] and times (n,) [s], in order of time.

    start, branch: times at which it sets off and becomes two [s], NaN for never. fastest [m/s].
    """

    place: np.ndarray
    time: np.ndarray
    start: float
    branch: float
    fastest: float


def branching(effort):
    """Times at which the crack sets off and branches, and its speed, by size of the elements."""
    edges = FINE_EDGES[: effort.sizes]
    found = [[forking(edge, seed) for seed in effort.seeds] for edge in edges]
    numbers = [number for edge, cracks in zip(edges, found) for number in of_size(edge, cracks)]
    slow = np.array([forking(edges[0], seed, LOW_PULL).fastest for seed in effort.seeds])
    words = f"largest speed at {1e-6 * LOW_PULL:g} MPa, elements of {1e3 * edges[0]:g} mm"
    row = "branching_speed_at_half_the_load", words, LIMIT, slow, 0.0, LIMIT, "m/s", SOURCE
    places = [1e3 * (one.place - [0.0, 0.5 * HEIGHT]).T for one in found[-1]]
    plate_mm = {"notch": 1e3 * NOTCH, "length": 1e3 * LENGTH, "reach": 500.0 * HEIGHT}
    return [*numbers, Number(*row)], {"places": places, **plate_mm}


def of_size(edge, cracks):
    """What the cracks in meshes of one size show; times of branching, if any branches."""
    start, branch, fastest = np.array([one[2:] for one in cracks]).T
    branched = ~np.isnan(branch)
    share = branched.astype(float)
    rows = [
        ("start", "crack sets off", 10.0, 1e6 * start, 7.0, 13.0, "us", ""),
        ("share", "meshes in which it branches", 1.0, share, 1.0, 1.0, "1", LIMITED),
        ("time", "it branches", 35.5, 1e6 * branch[branched], 31.0, 40.0, "us", ""),
        ("speed", "its largest speed", LIMIT, fastest, 0.0, LIMIT, "m/s", LIMITED),
    ]
    tag, size = f"{1e3 * edge:g}_mm", f"elements of {1e3 * edge:g} mm"
    return [
        Number(f"branching_{key}_{tag}", f"{words}, {size}", *values, SOURCE, miss)
        for key, words, *values, miss in rows
        if len(values[1])
    ]


def forking(edge, seed, pull=PULL):
    """The crack in a random mesh."""
    mesh = plate(LENGTH, HEIGHT, edge, seed, in_rows=False)
    middle = (0.5 * LENGTH, 0.5 * HEIGHT, 0.0)
    mesh = with_cut(mesh, "notch", middle, (0, 1, 0), lambda x: x[:, 0] < NOTCH)
    options = {"density": DENSITY, "tensile_strength": STRENGTH, "fracture_energy": ENERGY}
    more = {"friction_angle": 30.0, "cohesion": 2.0 * STRENGTH, "damping_ratio": 0.02}
    material = material_of(mesh, YOUNG, POISSON, **options, **more)
    laws = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    rollers = [effects.Roller(side, (0.0, 0.0, 1.0)) for side in ("back", "front")]
    pulls = [effects.Pressure(side, -pull) for side in ("top", "bottom")]
    scene = Scene(mesh, material, [*laws, *rollers, *pulls], unbonded=["notch"])
    method = ImplicitDashpots(springs_step(scene))
    with warnings.catch_warnings():
        # The notch only opens: nothing has to touch in it.
        warnings.filterwarnings("ignore", "faces of the mesh are unbonded", UserWarning)
        return seen(simulate(scene, method=method, until=TIME, samples=1, progress=None), edge)


def seen(result, edge):
    """What the bonds that broke tell of the crack."""
    model, when = result.model, result.broken_time
    place = model.mesh.points[model.topology.vertices].mean(axis=1)[:, :2]
    # Beside the loaded edges waves may break the plate by themselves.
    inside = np.abs(place[:, 1] - 0.5 * HEIGHT) < 0.45 * HEIGHT
    broke = np.flatnonzero(~np.isnan(when) & (place[:, 0] > NOTCH) & inside)
    broke = broke[np.argsort(when[broke], kind="stable")]
    place, when = place[broke], when[broke]
    if not len(when):
        return Crack(place, when, np.nan, np.nan, np.nan)
    fastest = speed(place[:, 0], when, WAY * edge / LIMIT)
    return Crack(place, when, when[0], forked(place, when, edge), fastest)


def speed(x, when, window):
    """Largest speed of the foremost place over a window of time [m/s]."""
    tip, times = np.maximum.accumulate(x), np.arange(when[0], when[-1] - window, 0.25 * window)
    ends = [tip[np.searchsorted(when, times + gone, side="right") - 1] for gone in (0.0, window)]
    return float(np.max((ends[1] - ends[0]) / window, initial=0.0))


def forked(place, when, edge):
    """Time at which broken faces of one slice first lie apart, in the next slice too [s]."""
    slices = np.floor((place[:, 0] - NOTCH) / (2.0 * edge)).astype(int)
    apart = [
        np.max(np.diff(np.sort(place[slices == k, 1])), initial=0.0) > APART * edge
        for k in range(slices.max() + 2)
    ]
    both = np.flatnonzero(np.array(apart[:-1]) & np.array(apart[1:]))
    return float(when[slices == both[0]].min()) if len(both) else np.nan
