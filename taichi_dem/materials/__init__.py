"""Materials of bodies, and the constants of what joins two of them."""

from taichi_dem.materials.material import CONCRETE, Material

__all__ = ["CONCRETE", "Material"]
