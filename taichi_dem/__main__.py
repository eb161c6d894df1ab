"""``python -m taichi_dem``: list effects, methods, meshes; with ``demo``, blast a block."""

import inspect
import sys
from collections.abc import Sequence

import taichi_dem
from taichi_dem import effects, materials, mesh, meshes, methods
from taichi_dem.kit import listing

_MESH_MODULES = ("mesh.mesh", "mesh.files", "mesh.shapes", "mesh.gmsh")


def sections() -> list[tuple[str, list]]:
    """Contents of the package by section, (title, rows); each name of ``__all__`` is in one."""
    made = [
        ("Effects", listing.described("taichi_dem.effects", effects, effects.__all__)),
        ("Methods", _rows([(methods, listing.own(methods, inspect.isclass))])),
        ("Materials", _rows([(materials, listing.instances(materials, materials.Material))])),
        ("Meshes", _rows([(meshes, listing.instances(meshes, str)), *_mesh_functions()])),
    ]
    shown = {name for _, rows in made for name, _ in rows}
    rest = listing.described("taichi_dem", taichi_dem, taichi_dem.__all__)
    rest = [row for row in rest if row[0] not in shown and "__" not in row[0]]
    return [*made, ("Scenes, runs and results", rest)]


def _mesh_functions():
    """Functions that make, read, write, check or reorder meshes, by module."""
    found = [m for m in listing.modules(mesh) if m.__name__.endswith(_MESH_MODULES)]
    return [(module, listing.own(module, inspect.isfunction)) for module in found]


def _rows(members):
    """Rows of [(module, names)], under the shortest name that can be imported."""
    rows = []
    for module, names in members:
        for name in names:
            short = "taichi_dem" if name in taichi_dem.__all__ else module.__name__
            rows += listing.described(short, module, [name])
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    return listing.run(taichi_dem, sections(), arguments)


if __name__ == "__main__":
    sys.exit(main())
