"""Tractions of a bond that is pulled or slid along a way, by its law."""

import numpy as np


def bond_tension(material, opening):
    """Traction [Pa] of a bond that is pulled along a way (Konno et al., Fig. 4).

    opening: its openings [m] in their order. It softens beyond its strength, unloads to the origin,
    is pressed at its full stiffness, and is gone once it has failed.
    """
    opening = np.asarray(opening, dtype=float)
    limit = np.maximum.accumulate(np.maximum(opening, material.onset_opening))
    left = material.failure_opening - limit
    stiffness = np.where(
        opening > 0.0, material.softening_slope * left / limit, float(material.normal_stiffness)
    )
    return np.where(left > 0.0, stiffness * opening, 0.0)


def bond_shear(material, sliding, pressure):
    """Shear traction [Pa] of a bond that is slid along a way (Konno et al., Fig. 3).

    sliding: in its order [m]. pressure: on the bond all the time [Pa]. It slips at cohesion +
    friction x pressure, and goes back elastically.
    """
    bound = max(0.0, material.cohesion + material.friction * pressure)
    slip, stiffness = 0.0, float(material.shear_stiffness)
    found = []
    for reach in np.asarray(sliding, dtype=float):
        found.append(float(np.clip(stiffness * (reach - slip), -bound, bound)))
        slip = reach - found[-1] / stiffness
    return np.array(found)
