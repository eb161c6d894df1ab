"""Effects that a scene may list; all others are not computed, allocated or compiled."""

from taichi_dem.effects.bond_damping import BondDamping
from taichi_dem.effects.face_contact import FaceContact
from taichi_dem.effects.friction import Friction
from taichi_dem.effects.gas_pressure import GasPressure
from taichi_dem.effects.gravity import Gravity
from taichi_dem.effects.pressure import Pressure
from taichi_dem.effects.quiet_boundary import QuietBoundary
from taichi_dem.effects.shear_slip import ShearSlip
from taichi_dem.effects.slip_weakening import SlipWeakening
from taichi_dem.effects.softening import Softening
from taichi_dem.effects.sphere_contact import SphereContact
from taichi_dem.effects.sticking_friction import StickingFriction
from taichi_dem.effects.supports import Fixed, PrescribedMotion, Roller

__all__ = [
    "BondDamping",
    "FaceContact",
    "Fixed",
    "Friction",
    "GasPressure",
    "Gravity",
    "PrescribedMotion",
    "Pressure",
    "QuietBoundary",
    "Roller",
    "ShearSlip",
    "SlipWeakening",
    "Softening",
    "SphereContact",
    "StickingFriction",
]
