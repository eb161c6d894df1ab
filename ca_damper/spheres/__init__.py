"""Spheres as filling of the container: discrete elements in the plane, one layer deep."""

from ca_damper.spheres.options import Spheres

__all__ = ["Spheres"]
