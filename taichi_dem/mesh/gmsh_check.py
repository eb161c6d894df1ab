"""Check of Gmsh files, of which readers take much as something else than it says (NumPy only).

A number of a point that is not positive, for instance, is read as another point counted from the
end. Text of the versions 2.2 and 4.1 is checked line by line, other files by their head and the
ends of their sections.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from typing import Any, NoReturn

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown

VERSIONS = ("2", "2.2", "4", "4.0", "4.1")
#: Bytes of a number, which every Gmsh for 64 bits writes.
_DATA_SIZE = "8"
_ONCE = ("MeshFormat", "PhysicalNames", "Entities", "Nodes", "Elements")
_MOST = 2**31 - 1


def refuse_bad_gmsh(path: str) -> None:
    """Raise InputError, with the line, for a Gmsh file that is not as its format says.

    Files that do not begin like one are left to other readers.
    """
    with open(path, "rb") as file:
        content = file.read()
    if not content.startswith(b"$MeshFormat"):
        return
    reader = _Lines(path, content[:4000] if _is_binary(content) else content)
    version = _checked_head(reader)
    if _is_binary(content):
        _check_ends(path, content)
        return
    reader.find_sections()
    if "PhysicalNames" in reader.sections:
        reader.begin("PhysicalNames")
        (count,) = reader.head(("the number of names",))
        reader.rows(count)
        reader.finish("PhysicalNames")
    if version.startswith("2"):
        _check_version_2(reader)
    elif version == "4.1":
        _check_version_4(reader)


def _is_binary(content):
    words = content[:200].split()
    return len(words) > 2 and words[2] == b"1"


def _check_ends(path, content):
    for name in ("Nodes", "Elements"):
        if content.count(f"${name}\n".encode()) != 1 or f"$End{name}".encode() not in content:
            raise InputError(f"mesh file {path} must have one whole section ${name}")


class _Lines:
    """Lines of a file, taken one after the other; sections by name, (first line, last line)."""

    def __init__(self, path, content):
        self.path, self.at = path, 0
        self.lines = content.decode("utf-8", "replace").splitlines()
        self.sections: dict[str, tuple[int, int]] = {}

    def refuse(self, words: str, back: int = 0) -> NoReturn:
        """Raise InputError that names the line taken last, or one before it."""
        line = self.at - back
        raise InputError(f"mesh file {self.path} cannot be read, line {line}: {words}")

    def find_sections(self) -> None:
        """Find all sections, each closed before the next begins."""
        name, first = "", 0
        for k, line in enumerate(self.lines):
            found = re.fullmatch(r"\$(\w+)\s*", line)
            if not found:
                continue
            self.at = k + 1
            if name and found[1] != f"End{name}":
                self.refuse(f"section ${name} must end with $End{name}, got {shown(line)}")
            if not name and found[1] in self.sections and found[1] in _ONCE:
                self.refuse(f"section ${found[1]} must be there once only")
            if name:
                self.sections[name] = (first, k)
            name, first = ("" if name else found[1]), k + 1
        if name:
            self.at = len(self.lines)
            self.refuse(f"section ${name} must end with $End{name}: the file is cut off")

    def rows(self, count: int) -> list[list[str]]:
        """The next lines as lists of words."""
        rows = [line.split() for line in self.lines[self.at : self.at + count]]
        self.at += len(rows)
        if len(rows) < count:
            self.refuse(f"{count} lines are announced, but the file ends before")
        return rows

    def integers(self, rows: list[list[str]]) -> np.ndarray:
        """Rows of as many whole numbers each, as an array."""
        widths = list(map(len, rows))
        for k, width in enumerate(widths):
            if width != widths[0] or width == 0:
                self.refuse(f"must hold {widths[0]} numbers, got {width}", len(rows) - 1 - k)
        try:
            return np.array(rows, dtype=object).astype(np.int64).reshape(len(rows), -1)
        except (ValueError, OverflowError):
            bad = next(k for k, row in enumerate(rows) if not all(map(_is_whole, row)))
            self.refuse(f"must hold whole numbers, got {shown(' '.join(rows[bad]))}")

    def head(self, names: tuple[str, ...], least: int = 0) -> list[int]:
        """The next line as whole numbers with these names, each from least to 2^31 - 1."""
        row = self.rows(1)[0]
        if len(row) != len(names) or not all(map(_is_whole, row)):
            self.refuse(f"must hold {', '.join(names)}, got {shown(' '.join(row))}")
        for name, word in zip(names, row):
            if not least <= int(word) <= _MOST:
                self.refuse(f"{name} must be from {least} to {_MOST}, got {word}")
        return [int(word) for word in row]

    def begin(self, name: str) -> None:
        """Go to the first line of a section."""
        if name not in self.sections:
            raise InputError(f"mesh file {self.path} must have a section ${name}")
        self.at = self.sections[name][0]

    def finish(self, name: str) -> None:
        """Check that the section ends here."""
        if self.at != self.sections[name][1]:
            self.at += 1
            self.refuse(f"section ${name} must end here, by the numbers that it announces")


def _is_whole(word: str) -> bool:
    return re.fullmatch(r"[+-]?[0-9]{1,18}", word) is not None


def _checked_head(reader) -> str:
    """Version of a file whose first lines are as they must be."""
    reader.at = 1
    words = reader.rows(1)[0]
    if len(words) != 3 or words[0] not in VERSIONS or words[1] not in ("0", "1"):
        reader.refuse(
            f"must hold a version of {', '.join(VERSIONS)}, 0 or 1 for text or binary, and the "
            f"size of a number, got {shown(' '.join(words))}"
        )
    if words[2] != _DATA_SIZE:
        reader.refuse(f"the size of a number must be {_DATA_SIZE} bytes, got {shown(words[2])}")
    return words[0]


def _check_version_2(reader) -> None:
    reader.begin("Nodes")
    (count,) = reader.head(("the number of points",), 1)
    rows = reader.rows(count)
    points = _numbers(reader, "point", [row[:1] for row in rows], count)
    _check_places(reader, [row[1:] for row in rows], 3)
    reader.finish("Nodes")
    reader.begin("Elements")
    (count,) = reader.head(("the number of elements",), 1)
    rows = reader.rows(count)
    reader.finish("Elements")
    _numbers(reader, "element", [row[:1] for row in rows], count)
    first = reader.at - count
    for kind, group in _by_type(rows):
        reader.at = first + group[-1] + 1
        members = reader.integers([rows[k] for k in group])
        tags = members[:, 2]
        if (tags != tags[0]).any() or not 0 <= tags[0] <= members.shape[1] - 4:
            reader.refuse(f"elements of type {kind} must have the same number of tags and points")
        _check_known(reader, members[:, 3 + tags[0] :], points)


def _by_type(rows) -> Iterator[tuple[str, list[int]]]:
    """Type and places of elements that follow each other and have it."""
    keyed = ((row[1] if len(row) > 1 else "", k) for k, row in enumerate(rows))
    for kind, group in itertools.groupby(keyed, key=lambda pair: pair[0]):
        yield kind, [k for _, k in group]


def _check_version_4(reader) -> None:
    points = _check_blocks(reader, "Nodes", "point", None)
    _check_blocks(reader, "Elements", "element", points)


def _check_blocks(reader, section, what, points):
    """Check the blocks of a section of version 4.1; returns the numbers of what it holds."""
    reader.begin(section)
    names = ("the number of blocks", f"the number of {what}s", "the least", "the largest number")
    blocks, count, least, most = reader.head(names)
    numbers = [np.empty(0, dtype=np.int64)]
    for _ in range(blocks):
        kind = "whether points are parametric" if points is None else "the type"
        names = ("the dimension", "the entity", kind, f"the number of {what}s")
        dimension, _, kind, size = reader.head(names)
        if dimension > 3:
            reader.refuse(f"the dimension must be from 0 to 3, got {dimension}")
        rows = reader.rows(size)
        numbers.append(_numbers(reader, what, [row[:1] for row in rows], size))
        if points is None:
            _check_places(reader, reader.rows(size), 3 + (dimension if kind else 0))
        elif size:
            _check_known(reader, reader.integers(rows)[:, 1:], points)
    found = np.concatenate(numbers)
    reader.finish(section)
    span = (len(found), found.min(initial=_MOST), found.max(initial=0))
    if span != (count, least, most) or len(np.unique(found)) < len(found):
        reader.begin(section)
        reader.at += 1
        reader.refuse(
            f"announces {count} {what}s numbered from {least} to {most}, but {span[0]} follow, "
            f"from {span[1]} to {span[2]}, {len(np.unique(found))} of them different"
        )
    return found


def _numbers(reader, what: str, rows: Any, count: int) -> np.ndarray:
    """Numbers in the first column of the lines read last: positive and different, (count,)."""
    if not count:
        return np.empty(0, dtype=np.int64)
    numbers = reader.integers(rows)[:, 0]
    bad = np.flatnonzero((numbers < 1) | (numbers > _MOST))
    if len(bad):
        words = f"the number of a {what} must be from 1 to {_MOST}, got {numbers[bad[0]]}"
        reader.refuse(words.replace("a element", "an element"), count - 1 - int(bad[0]))
    if len(np.unique(numbers)) < count:
        twice = np.flatnonzero(np.bincount(np.unique(numbers, return_inverse=True)[1]) > 1)
        reader.refuse(f"{what} {np.unique(numbers)[twice[0]]} must be there once only")
    return numbers


def _check_places(reader, rows, width) -> None:
    """Check lines of coordinates, those read last."""
    for k, row in enumerate(rows):
        if len(row) != width:
            reader.refuse(f"must hold {width} coordinates, got {len(row)}", len(rows) - 1 - k)
        try:
            list(map(float, row))
        except ValueError:
            reader.refuse(
                f"coordinates must be numbers, got {shown(' '.join(row))}", len(rows) - 1 - k
            )


def _check_known(reader, corners: np.ndarray, points: np.ndarray) -> None:
    """Check that elements, whose lines were read last, have points that are there."""
    bad = np.flatnonzero(~np.isin(corners, points).all(axis=1))
    if len(bad):
        corner = corners[bad[0]][~np.isin(corners[bad[0]], points)][0]
        reader.refuse(f"there is no point {corner}", len(corners) - 1 - int(bad[0]))
