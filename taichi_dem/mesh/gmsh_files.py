"""Gmsh files: what readers would take as something else than it says, and names of groups.

A number of a point that is not positive, for instance, is read as another point counted from the
end, and of faces and bodies in groups of one name a reader loses the faces.
"""

import os
import re
import tempfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown

_ENDS = re.compile(rb"^\$((?:End)?(?:Nodes|Elements))[ \t\r]*$", re.MULTILINE)
_WHOLE = [b"Nodes", b"EndNodes", b"Elements", b"EndElements"]
_NAMES = re.compile(rb"^\$PhysicalNames\s*\n(.*?)^\$EndPhysicalNames", re.MULTILINE | re.DOTALL)
_NAME = re.compile(r'\s*(\d+)\s+(\d+)\s+("?)(.*?)\3\s*')


class PhysicalName(NamedTuple):
    """A name in a file, the dimension of the cells that it names, and the number that they carry.

    These are the keys of ``field_data`` and ``cell_sets`` of a Gmsh file.
    """

    dimension: int
    tag: int
    name: str


def refuse_bad_gmsh(path: str) -> None:
    """Raise InputError for a Gmsh file that is cut off, or whose numbers do not fit each other.

    Text of the versions 2.2 and 4.1 is checked by its rows, other files by the ends of sections.
    Files that do not begin like one of Gmsh's are left to other readers.
    """
    with open(path, "rb") as file:
        content = file.read()
    if not content.startswith(b"$MeshFormat"):
        return
    marks = list(_ENDS.finditer(content))
    if [mark[1] for mark in marks] != _WHOLE:
        raise InputError("it must have one whole section $Nodes, then one $Elements")
    version, kind = content[:200].split()[1:3]
    rows_of = {b"2": _rows_2, b"2.2": _rows_2, b"4": _rows_4, b"4.1": _rows_4}.get(version)
    if kind == b"0" and rows_of:
        nodes, elements = (
            content[start.end() : end.start()].splitlines()[1:]
            for start, end in zip(marks[::2], marks[1::2])
        )
        _refuse_numbers(rows_of, nodes, elements)


def _refuse_numbers(rows_of, nodes, elements):
    """Check numbers of points, and that elements have points that are there."""
    try:
        points = np.array([int(row[0]) for row in rows_of(nodes, True)], dtype=np.int64)
        corners = np.array(
            [int(one) for row in rows_of(elements, False) for one in row], dtype=np.int64
        )
    except (ValueError, IndexError, OverflowError):
        raise InputError(
            "its sections must hold the rows of whole numbers that they announce"
        ) from None
    number, count = np.unique(points, return_counts=True)
    wrong = number[(number < 1) | (count > 1)]
    if len(wrong):
        raise InputError(f"its points must have different numbers from 1 on, got {wrong[0]}")
    missing = np.setdiff1d(corners, points)
    if len(missing):
        raise InputError(f"its elements have the point {missing[0]}, which is not there")


def _rows_2(lines, of_points):
    """Rows of version 2.2: number and places of each point, or corners of each element."""
    rows = [line.split() for line in lines]
    if len(rows) != int(rows[0][0]) + 1:
        raise ValueError
    if of_points:
        return _alike(rows[1:], 4)
    corners: dict[bytes, list] = {}
    for _, kind, tags, *rest in rows[1:]:
        corners.setdefault(kind, []).append(rest[_positive(tags) :])
    return [row for group in corners.values() for row in _alike(group, len(group[0]))]


def _rows_4(lines, of_points):
    """Rows of version 4.1: the number of each point, or corners of each element."""
    rows, found, at = [line.split() for line in lines], [], 1
    for _ in range(_positive(rows[0][0])):
        _, _, _, size = map(_positive, rows[at])
        block = rows[at + 1 : at + 1 + size]
        at += 1 + size
        if len(block) < size:
            raise ValueError
        if of_points:
            found += _alike(block, 1)
            _alike(rows[at : at + size], 3)
            at += size
        elif size:
            found += [row[1:] for row in _alike(block, len(block[0]))]
    if at != len(rows):
        raise ValueError
    return found


def _alike(rows, width):
    """Rows that are all as long."""
    if not width or any(len(row) != width for row in rows):
        raise ValueError
    return rows


def _positive(word):
    number = int(word)
    if number < 0:
        raise ValueError
    return number


@contextmanager
def with_own_keys(path: str) -> Iterator[tuple[str, Mapping[str, str]]]:
    """A file in which each physical group has a name of its own, and its true name by that.

    It is the file itself, or a copy where names repeat or hold what a reader takes for an escape.
    """
    with open(path, "rb") as file:
        content = file.read()
    section = _NAMES.search(content)
    rows = section[1].decode("utf-8").splitlines()[1:] if section else []
    found = [m.group(1, 2, 4) for m in map(_NAME.fullmatch, rows) if m]
    names = [name for _, _, name in found]
    clear = len({*names}) == len(names) and not any("\\" in name for name in names)
    if section is None or clear or len(found) < len(rows):
        yield path, {}
        return
    lines = [f'{dimension} {tag} "{k}"\n' for k, (dimension, tag, _) in enumerate(found)]
    start, end = section.span(1)
    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "keyed.msh")
        with open(copy, "wb") as file:
            file.write(content[:start] + f"{len(lines)}\n{''.join(lines)}".encode() + content[end:])
        yield copy, {str(k): name for k, name in enumerate(names)}


def keyed_by_dimension(raw: Any, names: Mapping[str, str]) -> Any:
    """A file of meshio's with groups by PhysicalName; names: the true ones of ``with_own_keys``."""
    keys = {
        key: PhysicalName(int(value[1]), int(value[0]), names.get(key, key))
        for key, value in raw.field_data.items()
        if np.shape(value) == (2,)
    }
    raw.field_data = {keys[key]: raw.field_data[key] for key in keys}
    raw.cell_sets = {keys.get(key, key): members for key, members in raw.cell_sets.items()}
    return raw


def physical_names(raw: Any, dimension: int) -> dict[int, str]:
    """Names of the physical groups of a dimension in a file of meshio's, by their numbers."""
    return {key.tag: key.name for key in raw.field_data if key.dimension == dimension}


def made_name(name: str, value: int, taken: Collection[Any]) -> str:
    """The name "NAME_VALUE" of a group that has only a number; InputError where another has it."""
    made = f"{name}_{value}"
    if made in taken:
        raise InputError(
            f"the group of number {value} must have a name, as {shown(made)}, which stands for it, "
            "must be that of one group only, got another group of this name"
        )
    return made
