"""Numbers that others have published, and ours beside them."""

from cases.trust.blast import blast
from cases.trust.bonds import disc, joint
from cases.trust.contacts import rotation, slope
from cases.trust.cracks import branching, crack
from cases.trust.waves import bar_wave, spall

#: In the order of the page.
MEASURES = bar_wave, spall, disc, crack, branching, joint, blast, slope, rotation
