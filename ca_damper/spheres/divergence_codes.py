"""Codes of divergence of the spheres, and how much energy contacts may give back."""

import math

# Codes of divergence; a speed is a runaway's when it crosses more than a radius in a step.
FINE, NOT_FINITE, RUNAWAY, OVERLAP, ENERGY_GAINED = range(5)
DIVERGENCES = {
    NOT_FINITE: "has a sphere whose velocity is not a finite number",
    RUNAWAY: "has a sphere that moves by more than its radius in a step",
    OVERLAP: "has spheres that overlap, or lie outside the container, by more than a radius",
    ENERGY_GAINED: "has contacts that give back more energy than they took",
}

# Share of their energy, as the container sees it, that spheres may gain from contacts: all of them
# may land in one step, and the leapfrog's energy is off by (w dt)^2 / 4 in a contact, half a period
# of w, of six steps. Measured at 20 us, with 1 to 100 spheres: 0.04 with the usual restitution; at
# 40 us, three steps a contact, up to 0.3.
MOST_GAIN = (math.pi / 6.0) ** 2 / 4.0
# Share of a gain, and of the energy that it is compared to, that is forgotten at each check: errors
# of many impacts of either sign add up to a spurious gain, while a diverging run shows within some
# 100 checks.
FORGOTTEN = 1.0 / 256.0
