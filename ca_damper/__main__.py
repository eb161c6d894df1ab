"""``python -m ca_damper``: list fillings and runs; with ``demo``, shake a box of grains."""

import sys
from collections.abc import Sequence

import ca_damper
from taichi_dem.kit import listing


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    return listing.run(ca_damper, {}, arguments)


if __name__ == "__main__":
    sys.exit(main())
