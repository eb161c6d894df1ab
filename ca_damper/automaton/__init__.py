"""The particles of the damper as a cellular automaton."""

from ca_damper.automaton.accounting import ACCOUNTINGS
from ca_damper.automaton.options import Automaton
from ca_damper.automaton.rules.paper import Paper
from ca_damper.automaton.rules.place import Place

__all__ = ["ACCOUNTINGS", "Automaton", "Paper", "Place"]
