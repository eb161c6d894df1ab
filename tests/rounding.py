"""How far rounding may move the momentum that particles and container exchange."""

import numpy as np

from ca_damper.automaton.accounting import QUANTUM

_EPS = np.finfo(float).eps


def momentum_rounding(batch):
    """Largest share of the momentum exchanged that rounding may leave open in a scene of a batch.

    The automaton rounds a particle's blow and its entries to half a quantum, at most three times a
    step; sums of n terms round by n eps of their magnitude, at most some m/s times the mass.
    """
    exchanged = batch.engine.table.in_use(batch.engine.account.exchanged)
    steps = batch.engine.table.in_use(batch.engine.coupling.step)
    mass = batch.table.column("particles") * batch.fillings.of_scenes(lambda one: one.particle_mass)
    rounding = mass * 1.5 * QUANTUM * steps + 4.0 * _EPS * steps * (exchanged + 10.0 * mass)
    return float((rounding / np.maximum(exchanged, 1e-300)).max())
