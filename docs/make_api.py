"""Write API pages of both packages from their docstrings: ``make api``, into results/api."""

import importlib
import pkgutil
import sys
import warnings
from pathlib import Path

import pdoc

# First, out of order: it prepares the environment for ``import taichi``.
from taichi_dem import runtime  # isort: skip # noqa: F401

import taichi as ti
from taichi.types.annotations import Template
from taichi.types.ndarray_type import NdarrayType

# Signatures of kernels then read as they are written, and the same in every build.
ti._lib.core.DataType.__repr__ = lambda self: f"ti.{self.to_string()}"
Template.__repr__ = lambda self: "ti.template()"
NdarrayType.__repr__ = lambda self: f"ti.types.ndarray({self.dtype}, ndim={self.ndim})"


def modules(package):
    """Names of a package and of all modules in it; pdoc by itself stops at ``__all__``."""
    path = importlib.import_module(package).__path__
    inside = (found.name for found in pkgutil.walk_packages(path, f"{package}."))
    return [package, *(name for name in inside if name != "taichi_dem.mesh.gmsh")]


if __name__ == "__main__":
    # What a package lists in __all__ comes twice.
    warnings.filterwarnings("ignore", "The module specification", UserWarning)
    names = [*modules("taichi_dem"), *modules("ca_damper")]
    pdoc.pdoc(*names, output_directory=Path(sys.argv[1]))
    print(f"The pages are {sys.argv[1]}/index.html")
