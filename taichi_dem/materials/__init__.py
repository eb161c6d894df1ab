"""Materials of bodies, and constants of bonds and contacts between them."""

from taichi_dem.materials.material import CONCRETE, Material

__all__ = ["CONCRETE", "Material"]
