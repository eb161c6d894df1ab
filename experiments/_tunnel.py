"""Designs of a tunnel round, their meshes and scenes, and what comes out of a blast."""

from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import taichi_dem as dem
from taichi_dem.kit.validation import choice
from taichi_dem.mesh.boreholes import Hole, drilled_rock, read_holes, with_charges
from taichi_dem.mesh.mesh import volumes
from taichi_dem.output.hole_monitor import Attenuation

#: Rock behind the face [m], and the middle of the round on it.
SIZE, MIDDLE = (4.0, 4.0, 3.0), (2.0, 2.0)
#: Granite as of measurements: moduli, density, strength, fracture energy.
ROCK = dem.Material.from_elastic(
    young=50e9,
    poisson=0.25,
    density=2700.0,
    tensile_strength=6e6,
    fracture_energy=200.0,
    friction_angle=45.0,
    cohesion=15e6,
)
#: Six holes in two rows, charged on the last two thirds of their length [m].
HEIGHTS, LENGTH, UNCHARGED = (1.6, 2.0, 2.4), 1.0, 1.0 / 3.0
#: Distance of a row from the middle, of straight holes and of a V; angle of the V [degrees].
APART, V_APART, V_ANGLE = 0.35, 0.48, 65.0
#: Slot: width, height and depth [m], and distances from the nearest row.
SLOT, BURDENS = (0.1, 1.4, 1.0), (0.2, 0.4, 0.8)
#: Diameter of the empty hole of a burn cut [m].
EMPTY = 0.38
#: Gas: peak [Pa] and rise [s]; the fall takes 2.75 times as long, as in the first paper.
PEAK, RISE = 575e6, 1.33e-4
QUIET = ("left", "right", "bottom", "top", "back")
#: Edges of elements far from holes over those near them, and their growth with each metre.
FAR, GROWTH, SIDES = 7.0, 0.35, 5
#: Distance from the middle of the charges at which peak velocities are given [m], and those from
#: and up to which a power of the distance is fitted.
PLACE, FITTED = 1.5, (0.8, 2.0)
#: Receivers: behind, beside and above the round [m].
RECEIVERS = {"behind": (2.0, 2.0, 0.6), "beside": (3.7, 2.0, 2.3), "above": (2.0, 3.7, 2.3)}
#: Speed of a piece towards the tunnel from which on it comes out [m/s].
OUT = 1.0
#: Name of the design of a user's table.
YOURS = "yours"
#: Designs whose meshes are kept for quick runs without Gmsh, and edges at their holes [m].
QUICK, QUICK_NEAR = ("parallel", "V cut"), 0.12
KEPT = Path(__file__).resolve().parent / "tunnel_meshes"
#: What the work of the gas went into: terms of the account, and those of the last two.
PARTS = {
    "radiated": ("ground_dashpot",),
    "broken": ("softening", "release"),
    "sliding": ("slip", "friction"),
    "dashpots": ("bond_dashpot", "sphere_dashpot"),
    "moving": ("kinetic",),
    "strain": ("bond_strain", "sphere_strain"),
}


class Design(NamedTuple):
    """Holes, and boxes that are cut out before the blast: corner and size (3,) [m] each."""

    holes: tuple
    slots: tuple = ()


def two_rows(apart, delay, angle=90.0):
    """Six charged holes; those of one height fire together, each height a delay [s] later.

    apart: distance of a row from the middle [m]. angle: with the face, towards the middle
    [degrees].
    """
    charge = {"length_m": LENGTH, "charge_from_m": UNCHARGED}
    return tuple(
        Hole(MIDDLE[0] + side * apart, y, angle_deg=lean, delay_s=k * delay, **charge)
        for side, lean in ((-1, angle), (1, 180.0 - angle))
        for k, y in enumerate(HEIGHTS)
    )


def slot_beside(burden):
    """A slot at a burden [m] from the left row of holes."""
    width, height, depth = SLOT
    corner = MIDDLE[0] - APART - burden - width, MIDDLE[1] - 0.5 * height, SIZE[2] - depth
    return (corner, SLOT)


def designs(delay=0.0):
    """Designs of the same charge, by name."""
    straight = two_rows(APART, delay)
    empty = Hole(*MIDDLE, LENGTH, charge_from_m=LENGTH, diameter_m=EMPTY)
    slots = {f"slot {one:g} m": Design(straight, (slot_beside(one),)) for one in BURDENS}
    return {
        "parallel": Design(straight),
        "V cut": Design(two_rows(V_APART, delay, V_ANGLE)),
        **slots,
        "burn cut": Design((*straight, empty)),
    }


def design_of(row):
    """The design that a row of a table of runs names, or that of its table of holes."""
    if row["design"] == YOURS:
        return Design(read_holes(row["holes"]))
    known = designs(row["delay_s"])
    return known[choice("designs", row["design"], list(known))]


def mesh_of(design, near, seed):
    """Mesh of a design by Gmsh, with edges near its holes [m]; a seed makes another one."""
    look = {"growth": GROWTH, "sides": SIDES, "slots": design.slots, "seed": seed}
    return drilled_rock(SIZE, design.holes, near, FAR * near, **look)


def path_of_kept(name):
    """File of the kept mesh of a design."""
    return KEPT / f"{name.replace(' ', '_')}.msh"


def kept_mesh(name):
    """The small mesh of a design that lies beside the programs; InputError where there is none."""
    if name not in QUICK:
        raise dem.InputError(
            f"a quick run has meshes of {', '.join(QUICK)}: give --near for {name}"
        )
    return dem.read_mesh(path_of_kept(name))


def scene_of(mesh, design, exponent=0.0):
    """The rock with gas in its charges; exponent: of gas that expands, 0 for the pressure given."""
    mesh, stages = with_charges(mesh, SIZE[2], design.holes)
    kind = dem.effects.GasPressure
    if exponent:
        gas = {"radius": radius_of(design), "exponent": exponent}
        kind = partial(dem.effects.ExpandingGas, **gas)
    loads = [kind(one, start=delay, peak=PEAK, rise=RISE) for one, delay in stages.items()]
    quiet = [dem.effects.QuietBoundary(side) for side in QUIET]
    return dem.Scene(mesh, ROCK, "auto", loads=[*loads, *quiet])


def charged(design):
    """Holes of a design that have a charge."""
    return [hole for hole in design.holes if hole.charged_m > 0.0]


def radius_of(design):
    """Radius of all charged holes [m], which gas that expands asks for; InputError for several."""
    wide = sorted({hole.diameter_m for hole in charged(design)})
    if len(wide) > 1:
        words = ", ".join(f"{one:g}" for one in wide)
        raise dem.InputError(
            f"diameter_m of the charged holes must be one number with --exponent, got {words}"
        )
    return 0.5 * wide[0]


def middle_of(design):
    """Middle of the charges (3,) [m]."""
    middles = [0.5 * (hole.charge_from_m + hole.length_m) for hole in charged(design)]
    return np.mean([h.at(SIZE[2], m) for h, m in zip(charged(design), middles)], axis=0)


def peaks(result, middle):
    """Distance from the middle [m], peak speed [m/s] and whether a body is behind, or beside.

    Bodies of the largest piece alone, the rock that stays: what flies out shakes nothing.
    """
    piece = result.fragment_of_body()
    stays = piece == np.bincount(piece, volumes(result.model.mesh)).argmax()
    away = (result.model.centre - middle)[stays]
    across, behind = np.hypot(away[:, 0], away[:, 1]), -away[:, 2]
    distance = np.hypot(across, behind)
    return distance, result.peak_speed[stays], behind > across, np.abs(behind) < across


def power_law(distance, speed, chosen):
    """Exponent of the fall of peak speeds with distance, and the speed at ``PLACE`` [m/s]."""
    fall = Attenuation(distance / PLACE, speed, chosen & (distance < FITTED[1]))
    slope, level = fall.power_law(FITTED[0] / PLACE)
    return -slope, level


def pieces(result):
    """Volume that comes out [m3], its mean speed towards the tunnel [m/s], and depth [m].

    What comes out has parted from the largest piece and moves out faster than ``OUT``; above the
    depth lie 95 % of it.
    """
    piece = result.fragment_of_body()
    volume, speed = volumes(result.model.mesh), result.frame().velocity[:, 2]
    own = np.bincount(piece, volume)
    mean = np.bincount(piece, volume * speed) / own
    out = (mean > OUT) & (np.arange(len(own)) != own.argmax())
    bodies = np.flatnonzero(out[piece])
    if not len(bodies):
        return 0.0, 0.0, 0.0
    depth = SIZE[2] - result.model.centre[bodies, 2]
    order = np.argsort(depth)
    upto = np.cumsum(volume[bodies][order])
    deepest = depth[order][np.searchsorted(upto, 0.95 * upto[-1])]
    return upto[-1], float((own * mean)[out].sum() / upto[-1]), float(deepest)


def parts_of_work(result):
    """What the work of the gas went into, as shares of it, and the work [J]."""
    last = {name: column[-1] for name, column in result.series.items()}
    work = last["load_work_J"]
    shares = {
        name: sum(last[f"{term}_J"] for term in terms) / work for name, terms in PARTS.items()
    }
    return work, shares


def measured(design, result):
    """What is measured of a run, numbers by name."""
    distance, speed, behind, beside = peaks(result, middle_of(design))
    work, shares = parts_of_work(result)
    volume, out, depth = pieces(result)
    side = {f"radiated_{one}_J": result.series[f"quiet_boundary_{one}_J"][-1] for one in QUIET}
    return {
        "tetrahedra": result.model.body_count,
        "beside_m_s": power_law(distance, speed, beside)[1],
        "behind_m_s": power_law(distance, speed, behind)[1],
        "exponent": power_law(distance, speed, behind | beside)[0],
        "radiated_kJ": 1e-3 * work * shares["radiated"],
        "out_m3": volume,
        "out_m_s": out,
        "depth_m": depth,
        "work_kJ": 1e-3 * work,
        **{f"{part}_share": share for part, share in shares.items()},
        "residual_share": result.series["residual_J"][-1] / work,
        **side,
        "cpu_s": result.report.run_cpu_seconds,
    }
