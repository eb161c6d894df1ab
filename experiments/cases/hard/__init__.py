"""Cases at the edge of what methods can compute, of both packages."""

from cases.hard import (
    blast_bonds,
    blast_contacts,
    blast_extremes,
    blast_piles,
    damper,
    damper_limits,
)

_OF_BLAST = blast_bonds, blast_contacts, blast_extremes, blast_piles
#: All cases, in the order of the page.
CASES = [case for part in (*_OF_BLAST, damper, damper_limits) for case in part.CASES]
