"""The version of both packages, written here only, and that of Taichi beneath them."""

import taichi as ti

# pyproject.toml reads it from here, as text: keep it a literal.
__version__ = "0.1.0"


def taichi_version() -> str:
    """Version of Taichi, such as 1.7.4."""
    # A package that runs from a path has no metadata.
    return ".".join(map(str, ti.__version__))
