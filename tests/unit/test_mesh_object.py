"""A Mesh cannot be made, or made into, anything that ``checked_mesh`` would not give."""

import copy
import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform
from taichi_dem.mesh.mesh import Mesh, checked_mesh
from taichi_dem.mesh.shapes import bar

BAR = bar(0.2, 0.05, (2, 1, 1))
FLAT = BAR.points * [1.0, 1.0, 0.0]
TURNED = BAR.tetrahedra[:, [0, 1, 3, 2]]
TWICE = np.repeat(BAR.groups["top"], 2, axis=0)
#: Arrays that ``checked_mesh`` refuses or mends, and a word of the sentence.
WRONG = {
    "text": (("a", BAR.tetrahedra, {}), "points must be an array"),
    "NaN": ((BAR.points * np.nan, BAR.tetrahedra, {}), "finite"),
    "flat": ((FLAT, BAR.tetrahedra, {}), "volume|coincide"),
    "one place": ((BAR.points * 0.0, BAR.tetrahedra, {}), "span"),
    "no such point": ((BAR.points, BAR.tetrahedra + 99, {}), "point numbers"),
    "numbers with fractions": ((BAR.points, BAR.tetrahedra * 1.0, {}), "integer"),
    "no bodies": ((BAR.points, BAR.tetrahedra[:0], {}), "empty"),
    "twice": ((BAR.points, np.repeat(BAR.tetrahedra, 2, axis=0), {}), "same four points"),
    "turned": ((BAR.points, TURNED, {}), "turned"),
    "loose points": ((np.vstack([BAR.points, [[9.0] * 3]]), BAR.tetrahedra, {}), "dropped"),
    "no group": ((BAR.points, BAR.tetrahedra, {"a": [[0, 1, 99]]}), "point numbers"),
    "groups": ((BAR.points, BAR.tetrahedra, [1]), "groups must be a dict"),
    "repeated": (
        (BAR.points, BAR.tetrahedra, {"a": np.repeat(BAR.groups["top"], 2, 0)}),
        "dropped",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_mesh_made_directly_is_checked_like_one_that_was_read(name):
    arrays, words = WRONG[name]
    with pytest.raises(InputError, match=words):
        Mesh(*arrays)
    if name not in ("text", "groups"):
        points, tetrahedra, groups = arrays
        with pytest.raises(InputError, match=words):
            replace(BAR, points=points, tetrahedra=tetrahedra, groups=groups)


def test_what_is_right_is_kept_and_lists_will_do():
    made = Mesh(BAR.points.tolist(), BAR.tetrahedra.tolist(), dict(BAR.groups))
    assert np.array_equal(made.points, BAR.points) and made.points.dtype == np.float64
    assert np.array_equal(made.tetrahedra, BAR.tetrahedra) and made.tetrahedra.dtype == np.int32
    assert {k: v.tolist() for k, v in made.groups.items()} == {
        k: v.tolist() for k, v in BAR.groups.items()
    }
    Simulation(Scene(made, CONCRETE), Uniform(1e-8))


COPIES = {
    "made": lambda: checked_mesh(BAR.points, BAR.tetrahedra, BAR.groups),
    "directly": lambda: Mesh(BAR.points, BAR.tetrahedra, BAR.groups),
    "pickled": lambda: pickle.loads(pickle.dumps(BAR)),
    "copied": lambda: copy.deepcopy(BAR),
    "replaced": lambda: replace(BAR, source="elsewhere"),
}


@pytest.mark.parametrize("name", COPIES)
def test_a_mesh_cannot_be_changed(name):
    mesh = COPIES[name]()
    for array in (mesh.points, mesh.tetrahedra, mesh.groups["top"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        mesh.groups["new"] = mesh.groups["top"]
    with pytest.raises(FrozenInstanceError):
        mesh.points = mesh.points * 2.0
    assert np.array_equal(mesh.points, BAR.points) and list(mesh.groups) == list(BAR.groups)


def test_arrays_of_the_caller_stay_his():
    points = BAR.points.copy()
    mesh = Mesh(points, BAR.tetrahedra, {})
    points[:] = np.nan
    assert np.isfinite(mesh.points).all() and points.flags.writeable
