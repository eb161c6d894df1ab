"""Spheres during contacts, and whole steps of the automaton while all grains fly."""

from ca_damper.combined.device import Combined

__all__ = ["Combined"]
