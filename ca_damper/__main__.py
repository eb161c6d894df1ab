"""``python -m ca_damper``: fillings of the damper, what runs them, and experiments there are."""

import ca_damper
from taichi_dem.kit import listing


def sections() -> list[tuple[str, list]]:
    """(Title, rows) of what the package offers; each name of ``__all__`` stands in one of them."""
    names = [name for name in ca_damper.__all__ if not name.startswith("__")]
    fillings = [name for name in names if hasattr(getattr(ca_damper, name), "bind")]
    rest = [name for name in names if name not in fillings]
    return [
        ("Fillings", listing.described("ca_damper", ca_damper, fillings)),
        ("Scenes, runs and results", listing.described("ca_damper", ca_damper, rest)),
    ]


if __name__ == "__main__":
    listing.run(ca_damper, sections())
