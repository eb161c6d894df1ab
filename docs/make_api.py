"""Write API pages of both packages from their docstrings: ``make api``, into results/api."""

import sys
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

if __name__ == "__main__":
    pdoc.pdoc("taichi_dem", "ca_damper", output_directory=Path(sys.argv[1]))
    print(f"The pages are {sys.argv[1]}/index.html")
