"""``python -m ca_damper``: list fillings and runs; with ``demo``, shake a box of grains."""

import sys
from collections.abc import Sequence

import ca_damper
from taichi_dem.kit import listing


def sections() -> list[tuple[str, list]]:
    """Contents of the package by section, (title, rows); each name of ``__all__`` is in one."""
    names = [name for name in ca_damper.__all__ if not name.startswith("__")]
    fillings = [name for name in names if hasattr(getattr(ca_damper, name), "bind")]
    rest = [name for name in names if name not in fillings]
    return [
        ("Fillings", listing.described("ca_damper", ca_damper, fillings)),
        ("Scenes, runs and results", listing.described("ca_damper", ca_damper, rest)),
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program; returns its exit code."""
    return listing.run(ca_damper, sections(), arguments)


if __name__ == "__main__":
    sys.exit(main())
