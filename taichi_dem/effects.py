"""Effects that a scene may list; all others are not computed, allocated or compiled."""

from taichi_dem.laws.body_contact import BodyContact
from taichi_dem.laws.bond import BondDamping, ShearSlip, SlipWeakening, Softening
from taichi_dem.laws.mixed_mode import MixedMode
from taichi_dem.laws.sphere_contact import Friction, SphereContact, StickingFriction
from taichi_dem.loads.pressure import ExpandingGas, GasPressure, Gravity, Pressure
from taichi_dem.loads.supports import Fixed, PrescribedMotion, QuietBoundary, Roller

__all__ = [
    "BodyContact",
    "BondDamping",
    "ExpandingGas",
    "Fixed",
    "Friction",
    "GasPressure",
    "Gravity",
    "MixedMode",
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
