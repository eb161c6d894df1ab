"""Forces on the container (Komatsuzaki et al., 6.2, eq. 11: the sum of m (v - v') / dt).

One file an accounting and one line in the table below; the contract is ``protocol.Accounting``.
"""

from ca_damper.automaton.accounting.all_impulses import AllImpulses
from ca_damper.automaton.accounting.landings import Landings, LandingsAndPushes
from ca_damper.automaton.accounting.protocol import Accounting
from ca_damper.automaton.accounting.uncounted import Uncounted

#: Accountings by the word that an ``Automaton`` takes.
ACCOUNTINGS = {
    "landing": Landings,
    "landing+ejection": LandingsAndPushes,
    "all": AllImpulses,
}

__all__ = [
    "ACCOUNTINGS",
    "Accounting",
    "AllImpulses",
    "Landings",
    "LandingsAndPushes",
    "Uncounted",
]
