"""Spheres where contacts last, whole steps of the automaton where all grains fly."""

from ca_damper.combined.device import Combined

__all__ = ["Combined"]
