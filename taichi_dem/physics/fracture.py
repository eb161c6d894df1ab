"""Tension and shear laws of a contact unit (Konno et al., 2.1, Fig. 3 and 4, eq. 1 and 2).

Tractions in Pa, openings in m, energies per area of the bond in J/m^2. The elastic limit of a
unit is an opening that starts at the onset u_E = f_t / k_n and follows the largest opening seen.
"""

import taichi as ti

from taichi_dem.kit.products import norm
from taichi_dem.kit.types import vec2


@ti.func
def envelope_traction(strength, onset, failure, opening):
    """Traction on the straight softening branch from the strength at onset to zero at failure."""
    return ti.max(0.0, strength * (failure - opening) / (failure - onset))


@ti.func
def softening_energy(strength, onset, failure, limit):
    """Energy spent by softening up to an elastic limit.

    The area under the law less what unloading gives back; the fracture energy after failure.
    """
    reached = ti.min(limit, failure)
    traction = envelope_traction(strength, onset, failure, reached)
    return 0.5 * (strength * reached - traction * onset)


@ti.func
def coulomb_limit(cohesion, friction, pressure):
    """Largest shear traction at a normal pressure (negative in tension), never below zero."""
    return ti.max(0.0, cohesion + friction * pressure)


@ti.func
def slip_beyond(stiffness, limit, sliding):
    """Slip that brings an elastic sliding [m] back onto the limit (eq. 2); zero below it."""
    slip = vec2(0.0, 0.0)
    reach = norm(sliding)
    if stiffness * reach > limit:
        slip = sliding * ((reach - limit / stiffness) / reach)
    return slip


@ti.func
def weakening_slip(stiffness, slope, cohesion, rubbing, reach):
    """Length of the slip [m] that brings an elastic sliding onto a limit that falls with the slip.

    stiffness [Pa/m]; slope: loss of cohesion with slip, less than the stiffness [Pa/m]. cohesion:
    now, negative by slope times the slip since it was zero [Pa]. rubbing: friction times pressure
    [Pa]. reach: length of the elastic sliding, beyond the limit [m].
    The limit is the largest of three lines; the first root of the three is the slip.
    """
    weakening = (stiffness * reach - cohesion - rubbing) / (stiffness - slope)
    return ti.max(0.0, ti.min(weakening, reach - rubbing / stiffness, reach))
