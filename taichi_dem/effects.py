"""Effects that a scene may list; all others are not computed, allocated or compiled.

``BondLaw``, ``TensionLaw``, ``ShearLaw``, ``Dashpot``, ``ContactLaw``, ``FrictionLaw``, ``Load``,
``Support`` and ``Ground`` are the contracts from which users derive effects of their own;
``BodyGeometry`` and ``SphereGeometry`` are what a contact law holds.
"""

from taichi_dem.laws.body_geometry import BodyGeometry
from taichi_dem.laws.bond import BondDamping, ShearSlip, SlipWeakening, Softening
from taichi_dem.laws.cohesive_crack import CohesiveCrack
from taichi_dem.laws.contact import BodyContact, SphereContact
from taichi_dem.laws.contact_contracts import ContactLaw, FrictionLaw
from taichi_dem.laws.contracts import BondLaw, Dashpot, Ground, Load, ShearLaw, Support, TensionLaw
from taichi_dem.laws.friction import Friction, StickingFriction
from taichi_dem.laws.mixed_mode import MixedMode
from taichi_dem.laws.sphere_geometry import SphereGeometry
from taichi_dem.laws.walton_braun import WaltonBraun
from taichi_dem.loads.pressure import ExpandingGas, GasPressure, Gravity, Pressure
from taichi_dem.loads.supports import Fixed, PrescribedMotion, QuietBoundary, Roller
from taichi_dem.loads.traction import Traction

__all__ = [
    "BodyContact",
    "BodyGeometry",
    "BondDamping",
    "BondLaw",
    "CohesiveCrack",
    "ContactLaw",
    "Dashpot",
    "ExpandingGas",
    "Fixed",
    "Friction",
    "FrictionLaw",
    "GasPressure",
    "Gravity",
    "Ground",
    "Load",
    "MixedMode",
    "PrescribedMotion",
    "Pressure",
    "QuietBoundary",
    "Roller",
    "ShearLaw",
    "ShearSlip",
    "SlipWeakening",
    "Softening",
    "SphereContact",
    "SphereGeometry",
    "StickingFriction",
    "Support",
    "TensionLaw",
    "Traction",
    "WaltonBraun",
]
