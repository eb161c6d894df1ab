"""Specimens for strength tests: supports that let bodies turn, slits of a finite width."""

import itertools
from functools import partial

import numpy as np
import pytest

from cases.closed_forms import LinearBonds, carried
from cases.meshes import group_area
from taichi_dem import CONCRETE, ImplicitDashpots, InputError, Scene, Simulation, effects, shapes
from taichi_dem.elasticity.mesh_stiffness import mesh_stiffness
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.tetrahedra import LOCAL_EDGES
from taichi_dem.mesh.topology import faces_of_group, topology_of
from tests.verification.test_forces_and_stress import damped

#: Height and width of beams, boxes that lie over their supports, way of the nose [m].
HEIGHT, OVER, WAY = 0.5, 0.25, 1e-6


class Beam:
    """A beam of boxes on two lines with a nose over its middle: x and y of lines along z."""

    def __init__(self, span, boxes):
        self.length, self.span = span + 2.0 * OVER, span
        self.mesh = bar(self.length, HEIGHT, boxes)
        middle, end = 0.5 * self.length, self.length - OVER
        self.lines = {"first": (OVER, 0.0), "second": (end, 0.0), "nose": (middle, HEIGHT)}
        wide = 0.8 * self.length / boxes[0]
        for name, (x, y) in self.lines.items():
            near = partial(_near, x, y, wide)
            self.mesh = self.mesh.group(name, near)
        top = topology_of(self.mesh)
        self.bodies = {k: np.unique(faces_of_group(self.mesh, top, k)[0]) for k in self.lines}

    def about(self, name):
        """Two points of a line."""
        x, y = self.lines[name]
        return (x, y, 0.0), (x, y, HEIGHT)


def _near(x, y, wide, centre):
    return (abs(centre[:, 0] - x) < wide) & (abs(centre[:, 1] - y) < 1e-9)


def constrained(beam, centre, size):
    """Rows of what is held, a foot a body, the way that each makes [m], its line and axis."""
    rows, ways, places = [], [], []
    for name, held in beam.bodies.items():
        for body, axis in itertools.product(held, range(3) if name == "nose" else [1]):
            row = np.zeros(size)
            arm = np.array([*beam.lines[name], centre[body, 2]]) - centre[body]
            row[6 * body : 6 * body + 6] = carried(arm)[axis]
            rows.append(row)
            ways.append(-WAY if (name, axis) == ("nose", 1) else 0.0)
            places.append((name, axis))
    return np.array(rows), np.array(ways), places


def in_balance(beam):
    """Displacements of the bodies (n, 3) [m] and forces (3,) [N] by line: linear statics."""
    matrix = LinearBonds(beam.mesh, CONCRETE).stiffness
    centre = beam.mesh.points[beam.mesh.tetrahedra].mean(axis=1)
    rows, ways, places = constrained(beam, centre, len(matrix))
    size, none = np.abs(matrix).max(), np.zeros((len(rows),) * 2)
    whole = np.block([[matrix, size * rows.T], [size * rows, none]])
    found = np.linalg.solve(whole, size * np.append(np.zeros(len(matrix)), ways))
    force = {name: np.zeros(3) for name in beam.lines}
    for (name, axis), pull in zip(places, size * found[len(matrix) :]):
        force[name][axis] -= pull
    return found[: len(matrix)].reshape(-1, 6)[:, :3], force


def deflection(beam, moved):
    """Of the middle against the ends, by the bodies around these sections [m]."""
    x = beam.mesh.points[beam.mesh.tetrahedra].mean(axis=1)[:, 0]
    first, second, middle = (
        moved[abs(x - place) < 0.251 * HEIGHT, 1].mean() for place, _ in beam.lines.values()
    )
    return 0.5 * (first + second) - middle


def test_a_beam_on_two_lines_comes_to_rest_where_its_bonds_are_in_balance():
    """Places and forces as a linear solution of the same bonds; of turns t = 1e-5 it lacks t.

    In 2.4e-2 s all motions fall by e^-12 or more; springs' dashpots are 5e-4 s times their
    stiffness. Forces are sums over stiff springs: a share of 1e-5 of what the largest of them has.
    """
    beam, short = Beam(1.0, (6, 2, 1)), {"history": ([0.0, 1e-3], [1.0, 0.0]), "turns": True}
    nose = effects.PrescribedMotion("nose", (0, -2e3 * WAY, 0), about=beam.about("nose"), **short)
    held = [
        effects.Roller(name, (0, 1, 0), turns=True, about=beam.about(name))
        for name in ("first", "second")
    ]
    scene = Scene(beam.mesh, damped(5e-4), [effects.BondDamping(), *held, nose])
    method = ImplicitDashpots(5e-6, sweeps=(2, 200), tolerance=1e-9)
    simulation = Simulation(scene, method)
    simulation.advance_to(4800)
    expected, force = in_balance(beam)
    moved = simulation.motion()["position"] - simulation.model.centre
    assert np.abs(moved - expected).max() < 1e-5 * WAY
    acting = dict(zip(beam.bodies, simulation.forces.on_bodies()))
    size = np.abs(force["nose"][1])
    for name, found in acting.items():
        assert np.abs(found.sum(axis=0) - force[name]).max() < 1e-4 * size
    account = simulation.energy_balance.account()
    assert abs(account["residual"]) < 1e-3 * account["support_work"]


def test_a_beam_on_two_lines_bends_by_beam_theory_less_what_bodies_bear_as_couples():
    """P l^3 / (48 E I) + P l / (4 k G A); each line bears half of P, and no moment.

    Bodies as high as h take couples: they add 7 (h / H)^2 to the rigidity of a beam of height H, as
    meshes of 4 to 12 of them show. A beam with clamped ends would bend a quarter as far.
    """
    boxes = 4
    beam = Beam(2.0, (5 * boxes, boxes, 1))
    (moved, force), solid = in_balance(beam), mesh_stiffness(beam.mesh, CONCRETE)
    load, area = -force["nose"][1], HEIGHT**2
    bent = load * beam.span**3 / (48.0 * solid.young_along[0] * area**2 / 12.0)
    sheared = load * beam.span / (4.0 * 5.0 / 6.0 * solid.shear_across[2] * area)
    found = deflection(beam, moved) / (bent + sheared)
    assert 1.0 / (1.0 + 8.0 / boxes**2) < found < 1.0
    for name in ("first", "second"):
        assert force[name] == pytest.approx([0.0, 0.5 * load, 0.0], rel=1e-6, abs=1e-6 * load)


@pytest.mark.parametrize("scatter", [None, 1])
def test_a_slit_takes_its_box_out_of_a_plate_and_of_a_beam(scatter):
    """Volume to rounding; each wall of the slit is in its group, and nothing else is."""
    slit, size = (0.1, 0.05, 0.01), (0.2, 0.1, 0.02)
    whole = {"element": 0.02, "scatter": scatter, "slit": slit}
    for mesh in (
        shapes.plate(width=size[0], height=size[1], thickness=size[2], **whole),
        shapes.beam(length=size[0], height=size[1], width=size[2], **whole),
    ):
        x, depth, width = slit
        assert volumes(mesh).sum() == pytest.approx(
            (size[0] * size[1] - depth * width) * size[2], rel=1e-12
        )
        wall = mesh.points[mesh.groups["slit"]]
        assert group_area(mesh, "slit") == pytest.approx((2 * depth + width) * size[2], rel=1e-12)
        on_side = np.isclose(abs(wall[..., 0] - x), 0.5 * width).all(axis=1)
        assert (on_side | np.isclose(wall[..., 1], depth).all(axis=1)).all()
        edges = mesh.points[mesh.tetrahedra[:, LOCAL_EDGES]]
        assert np.linalg.norm(np.diff(edges, axis=2), axis=-1).min() > 0.2 * width


def test_points_of_the_bottom_do_not_slide_into_a_slit():
    """This seed moves one there; no body would then lie at it."""
    slit = {"slit": (0.1, 0.05, 0.01), "element": 0.01, "scatter": 6}
    mesh = shapes.plate(width=0.2, height=0.1, thickness=0.02, **slit)
    assert volumes(mesh).sum() == pytest.approx((0.02 - 0.0005) * 0.02, rel=1e-12)


def test_what_cannot_be_a_slit_or_a_hinge_is_refused():
    plate = partial(shapes.plate, width=0.2, height=0.1, thickness=0.02, element=0.02)
    for slit in ((0.1, 0.05, 0.005), (0.01, 0.05, 0.01), (0.1, 0.09, 0.01), 0.1):
        with pytest.raises(InputError, match="slit must be"):
            plate(slit=slit)
    with pytest.raises(InputError, match="away from the hole"):
        plate(slit=(0.1, 0.05, 0.01), hole=(0.1, 0.07, 0.02))
    for about in ((1.0, 2.0), [(0, 0, 0), (0, 0, 0)], [[0, 0, 0]] * 3, 1.0):
        with pytest.raises(InputError, match="about must be a point"):
            effects.Roller("left", (1, 0, 0), turns=True, about=about)
    with pytest.raises(InputError, match="about must be left out"):
        effects.PrescribedMotion("left", (1, 0, 0), about=(0, 0, 0))
    pin = effects.PrescribedMotion("left", (0, 0, 0), turns=True)
    scene = Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [pin, effects.Fixed("left")])
    with pytest.raises(InputError, match="must not share bodies"):
        Simulation(scene, ImplicitDashpots(1e-6)).start()
