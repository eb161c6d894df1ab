"""``python -m taichi_dem``: list effects, methods, meshes; with ``demo``, blast a block."""

import sys
from collections.abc import Sequence

import taichi_dem
from taichi_dem import effects, methods, shapes
from taichi_dem.kit import listing


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    parts = {"Effects": effects, "Methods": methods, "Shapes": shapes}
    return listing.run(taichi_dem, parts, arguments)


if __name__ == "__main__":
    sys.exit(main())
