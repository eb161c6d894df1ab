"""The particles of the damper as a cellular automaton."""

from ca_damper.automaton.accounting import ACCOUNTINGS
from ca_damper.automaton.options import Automaton

__all__ = ["ACCOUNTINGS", "Automaton"]
