"""A file that is altered or cut off is refused, or read as what it was before."""

import warnings

import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, InputError, read_mesh
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.shapes import bar
from tests.bad_input.refusals import ends_within

pytestmark = pytest.mark.attack

BAR = bar(0.2, 0.1, (2, 1, 1))
NUMBERS = ("-1", "0", "2147483648", "99999999999999999999", "nan", "inf", "x", "1.5", "")


def read(path, content):
    """The mesh of a file with this content, or the sentence that refuses it."""
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    try:
        with ends_within(100.0), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return read_mesh(path)
    except InputError as error:
        assert str(path) in str(error) and "\n" not in str(error)
        return str(error)


@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_a_changed_gmsh_file_is_refused_or_read_as_the_same_bodies(tmp_path, version, seed):
    """Any word of the structure: heads, numbers and corners; places may be anywhere."""
    draw, path = np.random.default_rng(seed), tmp_path / "mesh.msh"
    write_mesh(path, BAR)
    with open(path if version == "2.2" else PAPER_BLOCK, encoding="utf-8") as file:
        lines = file.read().splitlines()
    whole = read(path, "\n".join([*lines, ""]))
    first, last = lines.index("$Elements") + 1, lines.index("$EndElements")
    for _ in range(12):
        row = int(draw.integers(first, last))
        words = lines[row].split()
        words[draw.integers(len(words))] = NUMBERS[draw.integers(len(NUMBERS))]
        changed = [*lines[:row], " ".join(words), *lines[row + 1 :], ""]
        found = read(path, "\n".join(changed))
        if not isinstance(found, str):
            assert np.array_equal(found.points, whole.points), (row, words)
            assert np.array_equal(found.tetrahedra, whole.tetrahedra), (row, words)
    text = "\n".join([*lines, ""])
    cut = int(draw.integers(1, text.index("$EndElements") + len("$EndElements") - 1))
    assert isinstance(read(path, text[:cut]), str)
