"""Names of Gmsh's physical groups: each dimension has its own, and a number for each."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import shown

_SECTION = re.compile(rb"^\$PhysicalNames\s*\n(.*?)^\$EndPhysicalNames", re.MULTILINE | re.DOTALL)
_ROW = re.compile(r'\s*(\d+)\s+(\d+)\s+("?)(.*?)\3\s*')


class PhysicalName(NamedTuple):
    """A name in a file, the dimension of the cells that it names, and the number that they carry.

    These are the keys of ``field_data`` and ``cell_sets`` of a Gmsh file: a reader that takes the
    name alone for a key loses the faces where faces and bodies have one name.
    """

    dimension: int
    tag: int
    name: str


@contextmanager
def with_own_keys(path: str) -> Iterator[tuple[str, Mapping[str, str]]]:
    """A file in which each physical group has a name of its own, and its true name by that.

    It is the file itself, or a copy where names repeat or hold what a reader takes for an escape.
    """
    with open(path, "rb") as file:
        content = file.read()
    section = _SECTION.search(content)
    rows = section[1].decode("utf-8").splitlines()[1:] if section else []
    found = [m.group(1, 2, 4) for m in map(_ROW.fullmatch, rows) if m]
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


def made_name(name: str, value: int, taken: Any) -> str:
    """The name "NAME_VALUE" of a group that has only a number; InputError where another has it."""
    made = f"{name}_{value}"
    if made in taken:
        raise InputError(
            f"the group of number {value} must have a name, as {shown(made)}, which stands for it, "
            "must be that of one group only, got another group of this name"
        )
    return made
