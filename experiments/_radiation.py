"""Radiation of a short charge in a long hole: an eighth of the rock, what is measured, theory.

The middle of the charge is the origin and the hole lies along z; three planes of symmetry carry
rollers, and the far side is quiet. No law of fracture and no dashpot of bonds acts.
"""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import minimize

import taichi_dem as dem
from _heelan import far_field, of_charge, ways
from _tunnel import ROCK
from taichi_dem import effects, shapes
from taichi_dem.elasticity.mesh_stiffness import mesh_stiffness
from taichi_dem.mesh import tetrahedra as geometry
from taichi_dem.mesh.boreholes import drilled_rock
from taichi_dem.mesh.gmsh import places_and_rows, prism, session
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import circle, drawn_out, in_space_order

#: Radius of the hole, half of its length and of that of the charge [m].
RADIUS, OPEN, CHARGE = 0.025, 0.17, 0.05
#: Size of elements at the hole and far from it for Gmsh [m], its growth, change from mesh to mesh.
NEAR, FAR, GROWTH, CHANGE = 0.015, 0.06, 0.3, 0.04
#: Where rock ends, and the shell in which the motion is read [m].
OUTER, SHELL = 2.1, (1.4, 1.6)
#: The same without Gmsh: radius, half of the charge, edge, end and shell [m].
COARSE = {"radius": 0.08, "charge": 0.08, "far": 0.1, "outer": 1.1, "shell": (0.7, 0.9)}
#: Pressure [Pa], small: the rock stays elastic.
PUSH = 1e6
#: Elements in a wave of shear at which amplitudes are taken: 8 are asked.
ELEMENTS = (16.0, 8.0, 5.0)
SYMMETRY = {"left": (1, 0, 0), "bottom": (0, 1, 0), "back": (0, 0, 1)}
#: Borders of the directions [degrees].
BINS = np.linspace(0.0, 90.0, 10)


def eighth_by_gmsh(seed):
    """An eighth of a ball of rock, and of a block without a hole for its stiffness."""
    scale = 1.0 + CHANGE * seed
    near, far = scale * NEAR, scale * FAR
    with session("eighth") as gmsh:
        occ, field = gmsh.model.occ, gmsh.model.mesh.field
        ball = occ.addSphere(0, 0, 0, OUTER, -1, 0.0, 0.5 * np.pi, 0.5 * np.pi)
        # Twelve sides around the area of the circle.
        wide = 2.0 * RADIUS * np.sqrt(np.pi / 3.0)
        corners = circle((0.0, 0.0), wide, np.pi * wide / 12.0)
        ring = [(x, y, -OUTER) for x, y in corners]
        occ.cut([(3, ball)], [prism(occ, ring, (0, 0, OUTER + OPEN))])
        occ.synchronize()
        edges = field.add("MathEval")
        away = f"Sqrt(x*x + y*y + (z - Min(z, {OPEN}))^2) - {RADIUS}"
        field.setString(edges, "F", f"Min({near} + {GROWTH} * ({away}), {far})")
        field.setAsBackgroundMesh(edges)
        gmsh.model.mesh.generate(3)
        points, tetrahedra = places_and_rows(gmsh, 4)
    block = drilled_rock((12.0 * far,) * 3, (), 0.5 * far, far)
    return eighth(points, tetrahedra, block, CHARGE, SHELL)


def coarse_eighth():
    """A quarter of a cylinder around a wide hole, and a block: needs no Gmsh."""
    radius, far, outer = (COARSE[name] for name in ("radius", "far", "outer"))
    angle = 0.5 * np.pi * np.linspace(0.0, 1.0, 17)[:, None]
    arc = np.hstack([np.cos(angle), np.sin(angle)])
    away = np.linspace(radius, outer, 11)[:, None]
    loop = [away[:-1] * (1, 0), outer * arc, away[-2:0:-1] * (0, 1), radius * arc[:0:-8]]
    made = drawn_out([np.vstack(loop)], outer, far, {}, scatter=1)
    block = shapes.block(6.0 * far, element=far, scatter=1)
    return eighth(made.points, made.tetrahedra, block, COARSE["charge"], COARSE["shell"])


def eighth(points, tetrahedra, block, charge, shell):
    """Rock with groups: planes of symmetry, the far side, the charged wall."""
    faces = geometry.outer_faces(tetrahedra)
    corners = points[faces]
    planes = {name: abs(corners[..., k]).max(axis=1) < 1e-6 for k, name in enumerate(SYMMETRY)}
    far = np.linalg.norm(corners, axis=2).min(axis=1) > shell[1]
    middle = corners.mean(axis=1)
    charged = ~np.any([*planes.values(), far], axis=0) & (middle[:, 2] < charge)
    groups = {name: faces[on] for name, on in {**planes, "far": far, "charge": charged}.items()}
    mesh = in_space_order(checked_mesh(points, tetrahedra, groups))
    return SimpleNamespace(mesh=mesh, block=block, shell=shell)


class Spectra:
    """Observer that sums v exp(i w t) dt of some bodies at some angular frequencies w [1/s]."""

    def __init__(self, bodies, frequencies, interval):
        self.when = dem.Every(time_s=interval)
        self.bodies, self.frequencies, self.interval = bodies, frequencies, interval
        self.sums = np.zeros((len(frequencies), len(bodies), 3), dtype=complex)

    def observe(self, view):
        """Add the present velocities."""
        turn = self.interval * np.exp(1j * self.frequencies * view.time_s)
        self.sums += turn[:, None, None] * view.motion()["velocity"][self.bodies]


def radiated(rock, method, interval):
    """Amplitudes by direction of a charge, (2, 3, 9), and what is known of them, as JSON has it.

    First P along the radius, then S across it, of every number of ``ELEMENTS``, times distance, per
    gas and volume: ours and those of theory there; ours without the near field, which is that of
    theory there less its far field, and the far field. The speeds of theory are those of our waves.
    """
    static = mesh_stiffness(rock.block, ROCK).wave_speeds
    static = np.array([static["pressure"], static["shear"]])
    bodies, places, edge = read_at(rock)
    turns = 2.0 * np.pi * static[1] / (edge * np.array(ELEMENTS))
    times, gas = pulse(turns[1])
    spectra = Spectra(bodies, turns, interval)
    loads = [effects.Pressure("charge", PUSH * gas, times), effects.QuietBoundary("far")]
    rollers = [effects.Roller(name, normal) for name, normal in SYMMETRY.items()]
    scene = dem.Scene(rock.mesh, ROCK, [*loads, *rollers])
    until = times[-1] + rock.shell[1] / static[1]
    told = {"samples": 1, "observers": [spectra], "title": "elastic"}
    report = dem.simulate(scene, method=method, until=until, **told).report
    volume, half = charge_of(rock.mesh)
    rows, speeds = [], []
    for turn, sums in zip(turns, spectra.sums):
        moved = sums / (PUSH * volume * np.trapezoid(gas * np.exp(1j * turn * times), times))
        found = speeds_of(places, moved, turn, half, static)
        theory = [one(places, turn, *found, half) for one in (of_charge, far_field)]
        ours, there, far = (lobes(places, one, turn / found) for one in (moved, *theory))
        rows.append(np.abs([ours, there, ours - there + far, far]))
        speeds.append(found.tolist())
    made = dict(zip(("ours_there", "there", "ours", "far"), np.moveaxis(rows, 0, 2).tolist()))
    seconds, static = (report.compile_seconds, report.run_seconds), static.tolist()
    known = {"speeds": speeds, "static": static, "bodies": rock.mesh.body_count}
    return {**made, **known, "seconds": seconds}


def read_at(rock):
    """Bodies that are read, their centres [m], and the mean edge there [m]."""
    places = rock.mesh.points[rock.mesh.tetrahedra].mean(axis=1)
    away = np.linalg.norm(places, axis=1)
    around = np.degrees(np.arctan2(places[:, 1], places[:, 0]))
    # Not those beside the planes of symmetry, which rollers hold.
    inside = (rock.shell[0] < away) & (away < rock.shell[1]) & (abs(around - 45.0) < 35.0)
    edges = geometry.edge_lengths(rock.mesh.points, rock.mesh.tetrahedra[inside])
    return np.flatnonzero(inside), places[inside], edges.mean()


def speeds_of(places, moved, turn, half, start):
    """Speeds of P and S waves with which theory, times one real number, is nearest to ours."""

    def misfit(factors):
        theory = of_charge(places, turn, *(factors * start), half)
        share = np.vdot(theory, moved).real / np.vdot(theory, theory).real
        return np.linalg.norm(moved - share * theory)

    return start * minimize(misfit, (1.0, 1.0), method="Nelder-Mead", tol=1e-4).x


def pulse(turn):
    """Times [s] and shares of a bell whose wave, its second derivative, is strongest at w."""
    wide = np.sqrt(2.0) / turn
    times = np.linspace(0.0, 7.0, 141)
    bell = np.exp(-0.5 * (times - 3.5) ** 2)
    return wide * times, bell - bell[0]


def charge_of(mesh):
    """Volume of the charge [m3] and half of its length [m], from the charged wall."""
    faces = mesh.group_faces("charge")
    vectors, middle = geometry.area_vectors(mesh.points, faces), mesh.points[faces].mean(axis=1)
    volume = 4.0 * abs((vectors[:, :2] * middle[:, :2]).sum())
    area = np.linalg.norm(vectors, axis=1)
    return volume, 2.0 * (area * middle[:, 2]).sum() / area.sum()


def lobes(places, moved, waves):
    """Amplitudes times distance along the radius and across it, by direction, (2, 9), complex.

    Means over the bodies between ``BINS``, each turned back by the phase of its wave. waves: wave
    numbers of P and S [1/m].
    """
    distance = np.linalg.norm(places, axis=1)
    which = np.digitize(np.degrees(np.arccos(places[:, 2] / distance)), BINS[1:-1])
    means = []
    for way, k in zip(ways(places), waves):
        wave = (moved * way).sum(axis=1) * distance * np.exp(-1j * k * distance)
        means.append([wave[which == n].mean() for n in range(len(BINS) - 1)])
    return np.array(means)
