"""Gmsh files: what readers would take as something else than it says, and names of groups.

A number of a point that is not positive, for instance, is read as another point counted from the
end, and of faces and bodies in groups of one name a reader loses the faces.
"""

import os
import re
import tempfile
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from taichi_dem.kit.errors import InputError

_ENDS = re.compile(rb"^\$((?:End)?(?:Nodes|Elements))[ \t\r]*$", re.MULTILINE)
_WHOLE = [b"Nodes", b"EndNodes", b"Elements", b"EndElements"]
_NAMES = re.compile(rb"^\$PhysicalNames\s*\n(.*?)^\$EndPhysicalNames", re.MULTILINE | re.DOTALL)
_NAME = re.compile(rb'^([ \t]*\d+[ \t]+\d+[ \t]+)("?)(.*?)\2[ \t\r]*$', re.MULTILINE)


class PhysicalName(NamedTuple):
    """A name in a file, the dimension of the cells that it names, and the number that they carry.

    These are the keys of ``field_data`` and ``cell_sets`` of a Gmsh file.
    """

    dimension: int
    tag: int
    name: str


def read_gmsh(path: str) -> Any:
    """A Gmsh file of meshio's with groups by PhysicalName; InputError for a bad one."""
    import meshio

    with open(path, "rb") as file:
        content = file.read()
    _refuse_bad(content)
    keyed, names = _with_own_keys(content)
    if not names:
        return keyed_by_dimension(meshio.read(path), {})
    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "keyed.msh")
        with open(copy, "wb") as file:
            file.write(keyed)
        return keyed_by_dimension(meshio.read(copy), names)


def _refuse_bad(content):
    """Refuse a Gmsh file that is cut off, or whose numbers do not fit each other.

    Text of the versions 2.2 and 4.1 is checked by its rows, other files by the ends of sections.
    Files that do not begin like one of Gmsh's are left to other readers.
    """
    if not content.startswith(b"$MeshFormat"):
        return
    marks = list(_ENDS.finditer(content))
    if [mark[1] for mark in marks] != _WHOLE:
        raise InputError("it must have one whole section $Nodes, then $Elements; it may be cut off")
    version, kind = content[:200].split()[1:3]
    if kind == b"1" or version not in (b"2", b"2.2", b"4", b"4.1"):
        return
    nodes, elements = (
        [line.split() for line in content[start.end() : end.start()].splitlines()[1:]]
        for start, end in zip(marks[::2], marks[1::2])
    )
    try:
        numbers = _numbers_2 if version.startswith(b"2") else _numbers_4
        points, corners = (np.array(found, dtype=np.int64) for found in numbers(nodes, elements))
    except (ValueError, IndexError, OverflowError):
        raise InputError("its sections must hold as many whole numbers as they announce") from None
    number, count = np.unique(points, return_counts=True)
    wrong = number[(number < 1) | (count > 1)]
    if len(wrong):
        raise InputError(f"its points must have different numbers from 1 on, got {wrong[0]}")
    missing = np.setdiff1d(corners, points)
    if len(missing):
        raise InputError(f"its elements have the point {missing[0]}, which is not there")


def _numbers_2(nodes, elements):
    """Numbers of points and of corners in version 2.2, where each row says how many tags it has."""
    sizes: dict[bytes, int] = {}
    corners: list[int] = []
    for _, kind, tags, *rest in elements[1:]:
        own = rest[int(tags) :]
        _require(int(tags) >= 0 and len(own) == sizes.setdefault(kind, len(own)) > 0)
        corners += map(int, own)
    for rows in (nodes, elements):
        _require(int(rows[0][0]) == len(rows) - 1)
    _require(all(len(row) == 4 for row in nodes[1:]))
    return [int(row[0]) for row in nodes[1:]], corners


def _numbers_4(nodes, elements):
    """The same in version 4.1, where a row of four numbers, the last its size, heads a block."""
    points, corners = (
        [[int(one) for one in row] for row in _rows_4(rows, each)]
        for rows, each in ((nodes, 2), (elements, 1))
    )
    return [one for (one,) in points], [one for row in corners for one in row[1:]]


def _rows_4(rows, each):
    """Rows of all blocks; each: how many an entry has, the places of a point are not among them."""
    at, found = 1, []
    for _ in range(int(rows[0][0])):
        _, _, _, size = map(int, rows[at])
        block = rows[at + 1 : at + 1 + each * size]
        _require(len(block) == each * size >= 0)
        _require(all(len(row) == len(block[0]) for row in block[:size]))
        _require(all(len(row) == 3 for row in block[size:]))
        found += block[:size]
        at += 1 + len(block)
    _require(at == len(rows))
    return found


def _require(right):
    if not right:
        raise ValueError


def _with_own_keys(content):
    """A file in which each physical group has a name of its own, and its true name by that.

    As names repeat, or hold what a reader takes for an escape.
    """
    names: dict[str, str] = {}

    def keyed(row):
        key = str(len(names))
        names[key] = row[3].decode("utf-8")
        return row[1] + key.encode()

    section = _NAMES.search(content)
    if section is None:
        return content, names
    start, end = section.span(1)
    return content[:start] + _NAME.sub(keyed, content[start:end]) + content[end:], names


def keyed_by_dimension(raw: Any, names: Mapping[str, str]) -> Any:
    """A file of meshio's with groups by PhysicalName; names: the true ones, by keys."""
    keys = {
        key: PhysicalName(int(value[1]), int(value[0]), names.get(key, key))
        for key, value in raw.field_data.items()
        if np.shape(value) == (2,)
    }
    raw.field_data = {keys[key]: raw.field_data[key] for key in keys}
    raw.cell_sets = {keys.get(key, key): members for key, members in raw.cell_sets.items()}
    return raw
