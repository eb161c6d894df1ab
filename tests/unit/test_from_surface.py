"""Solids filled by Gmsh from STL and STEP files; where it is missing, the sentence that says so."""

import sys

import numpy as np
import pytest

from taichi_dem import shapes
from taichi_dem.mesh.mesh import group_area, volumes
from taichi_dem.mesh.tetrahedra import edge_lengths
from tests.bad_input.refusals import assert_refused

try:
    import gmsh
except (ImportError, OSError):
    gmsh = None

needs_gmsh = pytest.mark.skipif(gmsh is None, reason="gmsh is not installed")
SIZE = np.array([0.2, 0.1, 0.1])


def write_stl(path, triangles):
    """An STL as text; triangles (n, 3, 3)."""
    lines = ["solid box"]
    for corners in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid box", ""]))
    return path


def box():
    """Twelve triangles of a box [mm]."""
    mesh = shapes.block(SIZE, element=0.1)
    faces = np.vstack(list(mesh.groups.values()))
    return 1e3 * mesh.points[faces]


@needs_gmsh
def test_a_closed_surface_is_filled(tmp_path):
    path = write_stl(tmp_path / "box.stl", box())
    mesh = shapes.from_surface(path, element=0.03, scale=1e-3)
    assert volumes(mesh).sum() == pytest.approx(SIZE.prod(), rel=1e-6)
    areas = sorted(group_area(mesh, name) for name in mesh.groups)
    assert areas == pytest.approx([0.01, 0.01, 0.02, 0.02, 0.02, 0.02], rel=1e-6)
    assert 0.5 * 0.03 < np.median(edge_lengths(mesh.points, mesh.tetrahedra)) < 1.5 * 0.03


@needs_gmsh
def test_a_step_file_is_filled_in_metres(tmp_path):
    path = str(tmp_path / "box.step")
    gmsh.initialize(interruptible=False, readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("box")
        gmsh.model.occ.addBox(0, 0, 0, *(1e3 * SIZE))
        gmsh.model.occ.synchronize()
        gmsh.write(path)
    finally:
        gmsh.finalize()
    mesh = shapes.from_surface(path, element=0.03)
    assert volumes(mesh).sum() == pytest.approx(SIZE.prod(), rel=1e-6)
    assert len(mesh.groups) == 6


@needs_gmsh
def test_what_is_not_closed_or_no_surface_is_refused(tmp_path):
    open_box = write_stl(tmp_path / "open.stl", box()[1:])
    assert_refused(
        lambda: shapes.from_surface(open_box, element=0.03), "must be closed", "3 of its"
    )
    (tmp_path / "empty.stl").write_text("nothing")
    (tmp_path / "empty.step").write_text("nothing")
    for name in ("empty.stl", "empty.step"):
        assert_refused(lambda name=name: shapes.from_surface(tmp_path / name, element=0.03), "")


@needs_gmsh
def test_more_elements_than_memory_holds_are_refused_before_gmsh_makes_them(tmp_path):
    """10^7 tetrahedra of 8.5 in a cube of an element: an edge of (8.5 V / 10^7)^(1/3)."""
    path = write_stl(tmp_path / "box.stl", box())
    least = (8.5 * SIZE.prod() / 1e7) ** (1.0 / 3.0)
    assert_refused(
        lambda: shapes.from_surface(path, element=1e-5, scale=1e-3),
        f"element must be at least {least:.3g} m",
        "0.002 m^3",
        "got 1e-05",
    )


def test_a_missing_gmsh_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    path = write_stl(tmp_path / "box.stl", box())
    assert_refused(lambda: shapes.from_surface(path, element=0.03), "needs gmsh", "pip install")


REFUSED = {
    "ending": (lambda: shapes.from_surface("a.obj", element=1), "path must end in .stl", "a.obj"),
    "missing": (lambda: shapes.from_surface("no.stl", element=1), "no.stl does not exist"),
    "element": (lambda: shapes.from_surface("no.stl", element=0), "element must be", "got 0"),
    "scale": (lambda: shapes.from_surface("no.stl", element=1, scale="mm"), "scale must", "'mm'"),
    "path": (lambda: shapes.from_surface(3, element=1), "path must be the name of a file", "3"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_surface_that_is_none_is_refused(case):
    call, *words = REFUSED[case]
    assert_refused(call, *words)
