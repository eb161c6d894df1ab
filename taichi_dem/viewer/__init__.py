"""View of a block in a browser: one HTML page with the frames of a run."""

from taichi_dem.viewer.block import show_block

__all__ = ["show_block"]
