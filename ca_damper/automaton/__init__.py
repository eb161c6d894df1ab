"""The particles of the damper as a cellular automaton."""

from ca_damper.automaton.options import ACCOUNTINGS, Automaton

__all__ = ["ACCOUNTINGS", "Automaton"]
