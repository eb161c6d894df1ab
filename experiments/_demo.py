"""Motion with which a demonstration or a hard case begins."""

import numpy as np


def set_moving(simulation, velocity, moved=0.0, spin=None):
    """Begin with a velocity [m/s], displacement [m] and spin [rad/s] of all bodies, (n, 3) each."""
    centre = simulation.model.centre
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (len(centre), 1))
    simulation.state.set_motion(centre + moved, turn, velocity, spin)
