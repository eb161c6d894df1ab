"""A crack that runs through a notched plate and branches, and its speed (Borden et al. 2012)."""

import itertools
from functools import partial
from typing import NamedTuple

import numpy as np

from _trust.meshes import material_of, plate, springs_step
from _trust.number import Number
from taichi_dem import ImplicitDashpots, Scene, effects, simulate
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, RED
from taichi_dem.mesh.mesh import with_cut

SOURCE = "Borden et al., CMAME 217 (2012) 77"
#: Plate: length, height, notch [m]; E [Pa], nu, density [kg/m3], and pull on both long edges [Pa].
LENGTH, HEIGHT, NOTCH, YOUNG, POISSON, DENSITY, PULL = 0.1, 0.04, 0.05, 32e9, 0.2, 2450.0, 1e6
#: Fracture energy of the plate, and that of its bonds [J/m2]: a crack takes twice as much as they
#: do over its plane (see ``crack``). Strength [Pa], of which the publication has none.
ENERGY, STRENGTH = 1.5, 3e6
#: Time [s], and the limit of the speed of cracks, 0.6 of Rayleigh's waves [m/s].
TIME, LIMIT = 80e-6, 1275.0
#: Edges of elements [m], coarse first.
EDGES = 2.8e-3, 2e-3, 1.4e-3
#: Another load [Pa]. From 2 MPa on both edges on, their waves meet beyond the strength, and the
#: plate opens along its middle at once.
LOW_PULL = 0.5e6
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
    edges = EDGES[: effort.sizes]
    found = [[crack(edge, seed) for seed in effort.seeds] for edge in edges]
    numbers = [number for edge, cracks in zip(edges, found) for number in of_size(edge, cracks)]
    slow = np.array([crack(edges[0], seed, LOW_PULL).fastest for seed in effort.seeds])
    size = f"elements of {1e3 * edges[0]:g} mm"
    words = f"largest speed at {1e-6 * LOW_PULL:g} MPa, {size}"
    rest = "m/s", SOURCE, LIMIT, slow, 0.0, LIMIT
    numbers.append(Number("branching_speed_at_half_the_load", words, *rest, note=LIMITED))
    return numbers, partial(draw, cracks=found[-1])


def of_size(edge, cracks):
    """What the cracks in meshes of one size show; times of branching, if any branches."""
    start, branch, fastest = np.array([one[2:] for one in cracks]).T
    branched = ~np.isnan(branch)
    share = "share", "meshes in which it branches", "1", 1.0, branched.astype(float), 1.0, 1.0
    rows = [
        ("start", "crack sets off", "us", 10.0, 1e6 * start, 7.0, 13.0, ""),
        (*share, LIMITED),
        ("time", "it branches", "us", 35.5, 1e6 * branch[branched], 31.0, 40.0, ""),
        ("speed", "its largest speed", "m/s", LIMIT, fastest, 0.0, LIMIT, LIMITED),
    ]
    tag, size = f"{1e3 * edge:g}_mm", f"elements of {1e3 * edge:g} mm"
    return [
        Number(f"branching_{key}_{tag}", f"{words}, {size}", unit, SOURCE, *values, note=note)
        for key, words, unit, *values, note in rows
        if len(values[1])
    ]


def crack(edge, seed, pull=PULL):
    """The crack in a random mesh."""
    mesh = plate(LENGTH, HEIGHT, edge, seed, in_rows=False)
    middle = (0.5 * LENGTH, 0.5 * HEIGHT, 0.0)
    mesh = with_cut(mesh, "notch", middle, (0, 1, 0), lambda x: x[:, 0] < NOTCH)
    options = {"density": DENSITY, "tensile_strength": STRENGTH, "fracture_energy": ENERGY}
    more = {"friction_angle": 30.0, "cohesion": 2.0 * STRENGTH, "damping_ratio": 0.02}
    material, _ = material_of(mesh, YOUNG, POISSON, **options, **more)
    laws = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    rollers = [effects.Roller(side, (0.0, 0.0, 1.0)) for side in ("back", "front")]
    pulls = [effects.Pressure(side, -pull) for side in ("top", "bottom")]
    scene = Scene(mesh, material, [*laws, *rollers, *pulls], unbonded=["notch"])
    method = ImplicitDashpots(springs_step(scene))
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


def draw(axes, cracks):
    """Broken faces ahead of the notch, a colour and a mark for each mesh."""
    axes.plot([0.0, 1e3 * NOTCH], [0.0, 0.0], color=BLACK, lw=1.5, label="notch")
    looks = zip((RED, BLUE, GREEN, ORANGE, GREY), "osD^v")
    for k, (one, (colour, mark)) in enumerate(zip(cracks, itertools.cycle(looks)), 1):
        look = {"color": colour, "marker": mark, "ms": 2.5, "ls": "none", "label": f"mesh {k}"}
        axes.plot(*1e3 * (one.place - [0.0, 0.5 * HEIGHT]).T, **look)
    reach = 500.0 * HEIGHT
    axes.set(xlabel="x [mm]", ylabel="y [mm]", xlim=(40.0, 1e3 * LENGTH), ylim=(-reach, reach))
    axes.set_aspect("equal")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, markerscale=2.0)
