"""Designs of a tunnel round, their meshes and scenes, and what comes out of a blast."""

from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import taichi_dem as dem
from taichi_dem.mesh.boreholes import Hole, drilled_rock, with_charges
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.output.hole_monitor import Attenuation

#: Rock behind the face [m], the middle of the round on it, and moduli and strengths of granite.
SIZE, MIDDLE = (4.0, 4.0, 3.0), (2.0, 2.0)
GRANITE = {"young": 50e9, "poisson": 0.25, "density": 2700.0, "fracture_energy": 200.0}
GRANITE |= {"tensile_strength": 6e6, "cohesion": 15e6, "friction_angle": 45.0}
QUIET = ("left", "right", "bottom", "top", "back")
#: Six holes in two rows, charged on the last two thirds of their length [m].
HEIGHTS, LENGTH, UNCHARGED = (1.6, 2.0, 2.4), 1.0, 1.0 / 3.0
#: Distance of a row from the middle, of straight holes and of a V; angle of the V [degrees].
APART, V_APART, V_ANGLE = 0.35, 0.48, 65.0
#: Slot 0.4 m from the left row, its corner and size [m]; diameter of the empty hole [m].
SLOT, EMPTY = ((MIDDLE[0] - APART - 0.5, 1.3, 2.0), (0.1, 1.4, 1.0)), 0.38
#: Gas: peak [Pa] and rise [s]; the fall takes 2.75 times as long, as in the first paper.
GAS = {"peak": 575e6, "rise": 1.33e-4}
#: Pressures in the rock along the direction that is asked for on the face, and across it [Pa].
PRESSED = 20e6, 2e6
#: Distance from the middle of the charges at which peak velocities are given [m], and those from
#: and up to which a power of the distance is fitted; speed from which on a piece comes out [m/s].
PLACE, FITTED, OUT = 1.5, (0.8, 2.0), 1.0
#: What the work of the gas went into: terms of the account.
PARTS = {
    "radiated": ("ground_dashpot",),
    "broken": ("softening", "release"),
    "sliding": ("slip", "friction"),
    "dashpots": ("bond_dashpot", "sphere_dashpot"),
    "moving": ("kinetic",),
    "strain": ("bond_strain", "sphere_strain"),
}
#: Designs whose meshes lie beside the programs, for runs without Gmsh; edge at their holes [m].
KEPT, KEPT_NEAR = {"parallel": "parallel.msh", "V cut": "V_cut.msh"}, 0.12
MESHES = Path(__file__).resolve().parents[1] / "tunnel_meshes"
#: Edges far from holes over those near them.
FAR = 7.0


class Design(NamedTuple):
    """Holes, and boxes that are cut out before the blast: corner and size (3,) [m] each."""

    holes: tuple
    slots: tuple = ()


def two_rows(apart, delay, angle=90.0):
    """Six charged holes; those of one height fire together, each height a delay [s] later."""
    charge = {"length_m": LENGTH, "charge_from_m": UNCHARGED}
    return tuple(
        Hole(MIDDLE[0] + side * apart, y, angle_deg=lean, delay_s=k * delay, **charge)
        for side, lean in ((-1, angle), (1, 180.0 - angle))
        for k, y in enumerate(HEIGHTS)
    )


def designs(delay=0.0):
    """Designs of the same charge, by name."""
    straight = two_rows(APART, delay)
    empty = Hole(*MIDDLE, LENGTH, charge_from_m=LENGTH, diameter_m=EMPTY)
    return {
        "parallel": Design(straight),
        "V cut": Design(two_rows(V_APART, delay, V_ANGLE)),
        "slot 0.4 m": Design(straight, (SLOT,)),
        "burn cut": Design((*straight, empty)),
    }


def mesh_of(name, design, near, seed):
    """Mesh by Gmsh with edges near the holes [m], or without these the one that is kept."""
    if near:
        return drilled_rock(SIZE, design.holes, near, FAR * near, slots=design.slots, seed=seed)
    if name not in KEPT:
        raise dem.InputError(f"designs must be of {', '.join(KEPT)} without --near, got {name}")
    return dem.read_mesh(MESHES / KEPT[name])


def stress_along(degrees):
    """Stress of ``PRESSED`` with its largest pressure at an angle from x to y, none along z."""
    along, across = PRESSED
    mean, half, twice = 0.5 * (along + across), 0.5 * (along - across), np.radians(2.0 * degrees)
    turned = half * np.cos(twice), half * np.sin(twice)
    return -mean - turned[0], -mean + turned[0], 0.0, -turned[1], 0.0, 0.0


def crack_direction(result):
    """Mean direction of cracks on the face, 0 to 180 from x to y [degrees], and how alike they are.

    By the area of broken faces seen along the tunnel: 0 for all directions alike, 1 for one alone.
    """
    broken, model = np.isfinite(result.broken_time), result.model
    vector = area_vectors(model.mesh.points, model.topology.vertices[broken])
    across = vector[:, 0] + 1j * vector[:, 1]
    size = np.abs(across)
    mean = (across**2 / np.maximum(size, 1e-300)).sum() / size.sum() if size.any() else 0.0
    return float(np.degrees(np.angle(mean)) / 2.0 + 90.0) % 180.0, float(np.abs(mean))


def scene_of(mesh, design, exponent=0.0, pressed_deg=None):
    """The rock with gas in its charges.

    exponent: of gas that expands, 0 for the pressure given. pressed_deg: see ``stress_along``.
    """
    mesh, stages = with_charges(mesh, SIZE[2], design.holes)
    loads = [dem.effects.QuietBoundary(side) for side in QUIET]
    for name, hole in stages.items():
        gas = dem.effects.GasPressure
        if exponent:
            gas = partial(dem.effects.ExpandingGas, radius=0.5 * hole.diameter_m, exponent=exponent)
        loads.insert(-len(QUIET), gas(name, start=hole.delay_s, **GAS))
    stress = None if pressed_deg is None else stress_along(pressed_deg)
    rock = dem.Material.from_elastic(**GRANITE)
    return dem.Scene(mesh, rock, "auto", loads=loads, stress=stress)


def peaks(design, result):
    """Distance from the charges [m], peak speed [m/s] and whether a body is behind, or beside.

    Bodies of the largest piece alone, the rock that stays: what flies out shakes nothing.
    """
    charged = [hole for hole in design.holes if hole.charged_m > 0.0]
    middles = [h.at(SIZE[2], 0.5 * (h.charge_from_m + h.length_m)) for h in charged]
    piece = result.fragment_of_body()
    stays = piece == np.bincount(piece, volumes(result.model.mesh)).argmax()
    away = (result.model.centre - np.mean(middles, axis=0))[stays]
    across, behind = np.hypot(away[:, 0], away[:, 1]), -away[:, 2]
    sides = {"beside": np.abs(behind) < across, "behind": behind > across}
    return np.hypot(across, behind), result.peak_speed[stays], sides


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


def measures(design, result):
    """Numbers of a run by name: peaks, what comes out, what the work of the gas went into."""
    distance, speed, sides = peaks(design, result)
    last = {name: column[-1] for name, column in result.series.items()}
    work = last["load_work_J"]
    shares = {part: sum(last[f"{term}_J"] for term in PARTS[part]) / work for part in PARTS}
    return {
        "tetrahedra": result.model.body_count,
        **{f"{side}_m_s": power_law(distance, speed, on)[1] for side, on in sides.items()},
        "exponent": power_law(distance, speed, sides["beside"] | sides["behind"])[0],
        "radiated_kJ": 1e-3 * work * shares["radiated"],
        **dict(zip(("out_m3", "out_m_s", "depth_m"), pieces(result))),
        "work_kJ": 1e-3 * work,
        **{f"{part}_share": share for part, share in shares.items()},
        "residual_share": last["residual_J"] / work,
        **dict(zip(("crack_deg", "crack_alike"), crack_direction(result))),
        **{f"radiated_{side}_J": last[f"quiet_boundary_{side}_J"] for side in QUIET},
        "cpu_s": result.report.run_cpu_seconds,
    }
