"""Holes drilled into rock: their table, their walls, gas that expands, energy by side."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from cases.tunnel import (
    KEPT,
    PRESSED,
    SIZE,
    crack_direction,
    designs,
    mesh_of,
    scene_of,
    stress_along,
)
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, effects, simulate
from taichi_dem.mesh.boreholes import Hole, check_holes, drilled_rock, read_holes, with_charges
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.mesh.tetrahedra import area_vectors
from tests.made_result import made_result


def kept_mesh(name):
    """The mesh of a design that lies beside the programs."""
    return mesh_of(name, designs()[name], None, 0)


@pytest.mark.parametrize("name", KEPT)
def test_gas_acts_on_the_charged_walls(name):
    """Wall and end of a prism of n sides: n chords times the length, and the round hole's area.

    A prism has the volume of the round hole. The boundary of a charge follows the mesh: within an
    edge, at most half of the charge here.
    """
    holes, sides = designs(delay=1e-4)[name].holes, 5
    mesh, stages = with_charges(kept_mesh(name), SIZE[2], holes)
    cut = sum(0.25 * np.pi * hole.diameter_m**2 * hole.length_m for hole in holes)
    assert volumes(mesh).sum() == pytest.approx(np.prod(SIZE) - cut, rel=1e-9)
    assert [hole.delay_s for hole in stages.values()] == [0.0, 1e-4, 2e-4]
    radius = 0.025 * np.sqrt(2.0 * np.pi / sides / np.sin(2.0 * np.pi / sides))
    around = 2.0 * sides * radius * np.sin(np.pi / sides)
    for name in stages:
        area = np.linalg.norm(area_vectors(mesh.points, mesh.groups[name]), axis=1).sum()
        exact = 2.0 * (around * holes[0].charged_m + np.pi * 0.025**2)
        assert area == pytest.approx(exact, rel=0.12)
        middle = mesh.points[mesh.groups[name]].mean(axis=1)
        assert (SIZE[2] - middle[:, 2]).min() > 0.9 * holes[0].charge_from_m * 0.9


def test_a_table_of_holes(tmp_path):
    """Columns by name; what is not given is as of Hole."""
    path = tmp_path / "holes.csv"
    path.write_text("y_m,x_m,length_m,angle_deg,delay_s\n1,2,0.8,65,0.001\n3,2,1,90,0\n")
    assert read_holes(path) == (Hole(2.0, 1.0, 0.8, 65.0, 0.0, 0.001), Hole(2.0, 3.0, 1.0))


@pytest.mark.parametrize(
    "text, words",
    [
        ("x_m,y_m\n1,1\n", "columns of a table of holes must be"),
        ("x_m,y_m,length_m,colour\n1,1,1,red\n", "columns of a table of holes must be"),
        ("x_m,y_m,length_m\n1,1,1\n1,1,-1\n", "hole 2: length_m must be"),
        ("x_m,y_m,length_m\nleft,1,1\n", "hole 1: x_m must be"),
        ("x_m,y_m,length_m,delay_s\n1,1,1,-1\n", "hole 1: delay_s must be .* got -1"),
        ("x_m,y_m,length_m,angle_deg\n1,1,1,5\n", "hole 1: angle_deg must be"),
        ("x_m,y_m,length_m,charge_from_m\n1,1,1,1.1\n", "hole 1: charge_from_m must be"),
    ],
)
def test_a_bad_table_is_refused(tmp_path, text, words):
    """One sentence with the number of the hole, the column and its value."""
    path = tmp_path / "holes.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_holes(path)


@pytest.mark.parametrize(
    "holes, words",
    [
        ([Hole(4.1, 2, 1)], r"hole 1 must lie inside the rock of \(4, 4, 3\) m, got \(4.1, 2, 3\)"),
        ([Hole(2, 2, 3.2)], "hole 1 must lie inside the rock"),
        ([Hole(3.8, 2, 1, angle_deg=60)], "hole 1 must lie inside the rock"),
        ([Hole(1.9, 2, 1, angle_deg=80), Hole(2.1, 2, 1, angle_deg=100)], "1 and 2 must not cross"),
    ],
)
def test_holes_outside_or_crossing_are_refused(holes, words):
    """Before anything is meshed."""
    with pytest.raises(InputError, match=words):
        check_holes(SIZE, holes)
    # As far apart as their walls allow.
    check_holes(SIZE, [Hole(2, 2, 1), Hole(2.051, 2, 1)])


def test_walls_that_a_mesh_does_not_show_are_refused():
    """A mesh without the hole, and a table without a charge."""
    mesh = bar(3.0, 4.0, (3, 4, 4))
    with pytest.raises(InputError, match=r"hole 1 at .2, 2. m needs .* on 0 % of its wall"):
        with_charges(mesh, 4.0, [Hole(2, 2, 1)])
    with pytest.raises(InputError, match="must have one that is charged"):
        with_charges(mesh, 4.0, [Hole(2, 2, 1, charge_from_m=1.0)])


@pytest.mark.skipif(importlib.util.find_spec("gmsh") is None, reason="gmsh is not installed")
def test_drilled_rock_has_its_volume_and_sides():
    """A slot and an inclined hole are missing from the box; sides are whole but for the face."""
    size, slot = (1.0, 1.0, 0.8), ((0.2, 0.3, 0.5), (0.1, 0.4, 0.3))
    hole = Hole(0.6, 0.5, 0.4, angle_deg=70)
    mesh = drilled_rock(size, [hole], 0.08, 0.3, slots=[slot], seed=3)
    cut = np.prod(slot[1]) + np.pi * 0.025**2 * 0.4
    assert volumes(mesh).sum() == pytest.approx(0.8 - cut, rel=1e-9)
    for name, area in {"left": 0.8, "right": 0.8, "bottom": 0.8, "top": 0.8, "back": 1.0}.items():
        vectors = area_vectors(mesh.points, mesh.groups[name])
        assert np.linalg.norm(vectors, axis=1).sum() == pytest.approx(area, rel=1e-9)


def test_gas_falls_with_the_volume():
    """Force on a wall that has moved by u: p A (1 + u / a)^(-2 exponent), p of the pulse.

    A load acts by its mean over a step, exact to (dt / rise)^2, 1e-4 here.
    """
    gas = {"peak": 1e6, "rise": 1e-4, "decay_ratio": 2.75}
    load = effects.ExpandingGas("base", radius=1e-3, exponent=1.4, **gas)
    scene = Scene(single(), CONCRETE, [load])
    result = simulate(scene, method=Uniform(1e-6), until=3e-4, samples=30, frames=30)
    area = 0.25 * np.sqrt(3.0) * 0.05**2
    # The base faces along x, the body flies to lower x, away from the gas.
    moved = np.array([-frame.displacement[0, 0] for frame in result.frames])
    exact = load.pressure_at(result.series["time_s"]) * area * (1.0 + moved / 1e-3) ** -2.8
    force = -result.series["expanding_gas_base_force_x_N"]
    assert moved[-1] > 0.3e-3
    assert np.abs(force - exact).max() < 1e-3 * exact.max()


@pytest.mark.parametrize("exponent", [0.3, 5.2, -0.2, float("nan")])
def test_an_exponent_that_is_no_multiple_of_a_fifth_is_refused(exponent):
    """Powers of a fifth root have the same bits everywhere."""
    with pytest.raises(InputError, match="exponent must be"):
        effects.ExpandingGas(exponent=exponent)


def test_a_round_has_gas_by_delay_and_diameter_and_fits_an_engine():
    """Half the diameter is the radius of the gas; Taichi has room for a thousand components."""
    design = designs(delay=1e-4)["V cut"]
    wide = replace(design.holes[0], diameter_m=0.052)
    scene = scene_of(kept_mesh("V cut"), design._replace(holes=(wide, *design.holes[1:])), 1.4)
    gas = [one for one in scene.loads if isinstance(one, effects.ExpandingGas)]
    wanted = [(0.0, 0.025), (0.0, 0.026), (1e-4, 0.025), (2e-4, 0.025)]
    assert [(one.start, one.radius) for one in gas] == wanted
    assert len(scene.loads) == 9
    Simulation(scene, Uniform(1e-7))


def test_the_direction_of_cracks_and_of_the_largest_pressure():
    """Faces across x are cracks along y. Pressure along n: n s n = -20 MPa, across it -2 MPa."""
    mesh = bar(0.4, 0.4, (2, 2, 2))
    whole = made_result(mesh=mesh, frames=1)
    normal = whole.model.bonds["frame"][:, 0]
    for axis, degrees in ((0, 90.0), (1, 0.0)):
        along = np.abs(normal[:, axis]) > 0.99
        one = replace(whole, broken_time=np.where(along, 0.0, np.nan))
        assert crack_direction(one) == pytest.approx((degrees, 1.0), abs=1e-12)
    nothing = np.full(len(normal), np.nan)
    assert crack_direction(replace(whole, broken_time=nothing))[1] == 0.0
    xx, yy, zz, xy, yz, zx = stress_along(30.0)
    way = np.array([np.cos(np.pi / 6.0), 0.5])
    turned = np.array([[xx, xy], [xy, yy]])
    assert -(turned @ way) == pytest.approx(PRESSED[0] * way, rel=1e-12)
    assert turned.trace() == pytest.approx(-sum(PRESSED), rel=1e-12) and zz == yz == zx == 0.0
