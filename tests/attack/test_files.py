"""Files that are not as their format says, and files of an earlier run."""

import os
import subprocess
import sys
import time
import warnings

import meshio
import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, InputError, read_mesh
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.shapes import bar
from tests.processes import users_environment
from tests.scenes import ROOT

ATTACKS = "files: altered, cut off, too large, of others"
BAR = bar(0.2, 0.1, (2, 1, 1))
NUMBERS = ("-1", "0", "2147483648", "99999999999999999999", "nan", "inf", "x", "1.5", "")


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    """Lines of good files of the versions 2.2 and 4.1, and their bodies."""
    path = tmp_path_factory.mktemp("gmsh") / "bar.msh"
    write_mesh(path, BAR)
    with open(PAPER_BLOCK, encoding="utf-8") as file:
        return {"2.2": path.read_text().splitlines(), "4.1": file.read().splitlines()}


def read(path, text):
    """The mesh of a file with this text, or the sentence that refuses it."""
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return read_mesh(path)
    except InputError as error:
        assert str(path) in str(error) and "\n" not in str(error)
        return str(error)


def changed(lines, row, column, word):
    """Text with a word of a line replaced; column None: the whole line."""
    words = lines[row].split()
    words[slice(None) if column is None else slice(column, column + 1)] = [word]
    return "\n".join([*lines[:row], " ".join(words), *lines[row + 1 :], ""])


def row_of(lines, section, more=1):
    return lines.index(f"${section}") + more


@pytest.mark.parametrize(
    ("version", "section", "more", "column", "word", "said"),
    [
        ("2.2", "MeshFormat", 1, 2, "4", "must be 8 bytes, got '4'"),
        ("4.1", "MeshFormat", 1, 2, "-8", "must be 8 bytes"),
        ("2.2", "MeshFormat", 1, 0, "2.25", "a version of"),
        ("2.2", "MeshFormat", 1, 1, "-1", "0 or 1 for text or binary"),
        ("2.2", "Elements", 2, 0, "-1", "number of an element must be from 1"),
        ("4.1", "Elements", 3, 0, "-1", "number of an element must be from 1"),
        ("2.2", "Elements", 3, 0, "1", "element 1 must be there once"),
        ("2.2", "Elements", 2, -1, "0", "there is no point 0"),
        ("4.1", "Elements", 3, -1, "-1", "there is no point -1"),
        ("2.2", "Elements", 2, 2, "3", "the same number of tags and points"),
        ("2.2", "Elements", 1, 0, "3", "must end here"),
        ("4.1", "Elements", 2, 0, "4", "dimension must be from 0 to 3"),
        ("4.1", "Elements", 1, 1, "99", "announces 99 elements"),
        ("2.2", "Nodes", 2, 0, "1.5", "must hold whole numbers"),
        ("2.2", "Nodes", 1, 0, "99999999999", "must be from 1 to"),
        ("2.2", "Nodes", 2, 1, "1,5", "must be numbers"),
        ("2.2", "PhysicalNames", 1, 0, "-1", "number of names"),
    ],
)
def test_what_is_not_as_the_format_says_is_named(
    lines, tmp_path, version, section, more, column, word, said
):
    text = lines[version]
    row = row_of(text, section, more)
    column = len(text[row].split()) - 1 if column == -1 else column
    sentence = read(tmp_path / "mesh.msh", changed(text, row, column, word))
    assert isinstance(sentence, str) and said in sentence and "line " in sentence


def test_a_changed_number_is_refused_or_read_as_the_same_bodies(lines, tmp_path, seed):
    """Any word of the structure: heads, numbers and corners; places may be anywhere."""
    draw = np.random.default_rng(seed)
    for version in lines:
        text = lines[version]
        whole = read(tmp_path / "good.msh", "\n".join([*text, ""]))
        first, last = row_of(text, "Elements"), row_of(text, "EndElements", 0)
        for _ in range(12):
            row = int(draw.integers(first, last))
            column = int(draw.integers(0, len(text[row].split())))
            word = NUMBERS[draw.integers(len(NUMBERS))]
            found = read(tmp_path / "mesh.msh", changed(text, row, column, word))
            if not isinstance(found, str):
                assert np.array_equal(found.points, whole.points), (row, column, word)
                assert np.array_equal(found.tetrahedra, whole.tetrahedra), (row, column, word)


def test_a_file_that_is_cut_off_is_refused(lines, tmp_path, seed):
    draw = np.random.default_rng(seed)
    for text in lines.values():
        whole = "\n".join([*text, ""])
        end = whole.index("$EndElements") + len("$EndElements") - 1
        cut = whole[: int(draw.integers(1, end))]
        assert isinstance(read(tmp_path / "mesh.msh", cut), str)


@pytest.mark.parametrize("version", ["gmsh22", "gmsh"])
def test_binary_files_are_read_whole_or_refused(tmp_path, version, seed):
    draw = np.random.default_rng(seed)
    path = tmp_path / "binary.msh"
    meshio.Mesh(BAR.points, [("tetra", BAR.tetrahedra)]).write(path, version, binary=True)
    content = path.read_bytes()
    assert read(path, content).body_count == BAR.body_count
    assert isinstance(read(path, content[: int(draw.integers(len(content) - 20))]), str)
    assert "8 bytes" in read(path, content.replace(b" 1 8\n", b" 1 4\n"))


def test_files_of_an_earlier_run_are_named_and_stay(tmp_path):
    """Hidden files, notes of the user, and files of this very run are not."""
    for name in ("old.png", ".hidden.csv", "notes.odt", "digest.txt", "new.csv"):
        (tmp_path / name).write_text("x")
        age = -100.0 if name == "new.csv" else 3600.0
        os.utime(tmp_path / name, (time.time() - age,) * 2)
    program = os.path.join(ROOT, "tests", "attack", "short_run.py")
    command = [sys.executable, program, "--out", str(tmp_path)]
    environment = users_environment(PYTHONPATH=ROOT)
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1:] == [f"Not of this run, in {tmp_path}: old.png"]
    assert (tmp_path / "old.png").read_text() == "x"
