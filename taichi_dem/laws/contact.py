"""Linear contact of spheres (Konno et al., section 2.2) and of whole bodies."""

import math

import taichi as ti

from taichi_dem.kit.validation import between, positive
from taichi_dem.laws.body_geometry import BodyGeometry
from taichi_dem.laws.contact_contracts import ContactLaw, Push
from taichi_dem.laws.sphere_geometry import SphereGeometry
from taichi_dem.materials import Material
from taichi_dem.materials.bond_rules import typical_of

#: Halvings of an interval until it is as short as a number can tell.
_BISECTIONS = 64


def damping_ratio(restitution: float) -> float:
    """Share z of critical damping at which a spring and a dashpot that never pull rebound so."""
    # Contact ends when its force is zero: -ln e = 2 z acos(z) / sqrt(1 - z^2), with acosh from z =
    # 1 (e = 0.135) on (Schwager and Poeschel, Granular Matter 9 (2007) 465).
    low, high = 0.0, 1.0 / restitution
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _lost(middle) > -math.log(restitution) else (middle, high)
    return low


def _lost(ratio):
    """-ln e of a damping ratio."""
    if ratio < 1.0:
        return 2.0 * math.acos(ratio) / math.tan(math.acos(ratio))
    turns = math.acosh(ratio)
    return 2.0 * turns / math.tanh(turns) if turns else 2.0


@ti.data_oriented
class LinearContact(ContactLaw):
    """Spring and dashpot, whose stiffness and coefficient are the numbers of a pair."""

    @ti.func
    def push(self, m, k, touch):
        """Repulsion of the spring."""
        return Push(elastic=self.law[m, 0] * touch.overlap, spent=0.0)

    @ti.func
    def stored(self, m, k, touch):
        """Energy of the spring."""
        return 0.5 * self.law[m, 0] * touch.overlap * touch.overlap

    @ti.pyfunc
    def stiffness_at(self, numbers, overlap):
        """The stiffness, at any overlap."""
        return numbers[0]

    @ti.pyfunc
    def damping_at(self, numbers, overlap):
        """The coefficient, at any overlap."""
        return numbers[1]


@ti.data_oriented
class SphereContact(LinearContact):
    """Spheres inscribed behind free faces repel each other (Konno et al., section 2.2).

    Parameters
    ----------
    divisions : int, default 5
        Equal parts of the edges of a face; 5 gives the paper's six spheres a face.
    outer_faces : bool or str, default True
        True: outer faces carry spheres from the start. ``"once_broken"``: from the first break of
        any bond. False: only broken faces carry them, as in the paper; others do not touch.
    skin : float, default 0.015
        Gap up to which spheres enter the candidate list, at least, as a share of the radius of a
        body; more where bodies are fast. It changes time, not results.
    """

    knob, firmer = "contact_stiffness", "a contact_stiffness of {value:.2g} N/m"
    calmer, undamped = "a larger contact_damping", "contact_damping of the material is 0"

    def __init__(
        self,
        divisions: int = 5,
        outer_faces: bool | str = True,
        skin: float = 0.015,
    ):
        super().__init__(SphereGeometry(divisions, outer_faces, skin))

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Stiffness [N/m] and damping [N s/m] of a contact."""
        return float(material.contact_stiffness), float(material.contact_damping)


@ti.data_oriented
class BodyContact(LinearContact):
    """Bodies repel each other by the gradient of an energy of their overlap, also at outer faces.

    The contact of ``effects="auto"`` and ``"all"``. The energy of a pair is k (q - q0)^2 / 2 with k
    the stiffness per area and q the size of the overlap (where flat sides meet: the root of the
    contact area times the depth); q0 is the smallest q since the two could first touch. So a break
    injects no energy. A dashpot acts on the rate of q, never as attraction.

    Parameters
    ----------
    parts : int, default 3
        Equal parts of the edges of a face; parts^2 rays go from the middle of a body to each face.
        Those of the smaller body of a pair count more, by the square of the ratio of volumes.
    outer_faces : bool or str, default True
        True: outer faces meet from the start. ``"once_broken"``: from the first break of any bond.
    restitution : float, default 0.1
        Speed at which two loose bodies part over that at which they met, from 0.01 to 1 [-].
    stiffness : float, optional
        Stiffness per area [Pa/m]; by default that of a bond of the usual size.
    skin : float, default 0.0075
        Gap up to which pairs are candidates, as a share of a body's radius: time, not results.

    Notes
    -----
    The dashpot is c = 2 z sqrt(k A m), z the damping ratio of ``restitution``, A the present area
    of contact and m = m1 m2 / (m1 + m2) of the two bodies. Then q obeys, whatever its shape, one
    linear law, so the restitution is exact for two bodies that meet along the line of their centres
    at rest, faces, edges or vertices first, at any speed, but for 2 z sqrt(k A / m) times the step.
    Bodies hit off their centres, or on several bodies at once, rebound less; bodies in a bonded
    piece, which are heavier in effect, more. With the default a block of four elements in height
    rests on slopes up to 0.94 of its friction, whatever the damping of its bonds.

    References
    ----------
    Munjiza, The combined finite-discrete element method (2004), for the potential. Schwager and
    Poeschel, Granular Matter 9 (2007) 465, for the restitution of a dashpot that never pulls.
    """

    knob, firmer = "stiffness", "{law}(stiffness={value:.2g}), in Pa/m"
    calmer, undamped = "a smaller restitution of BodyContact", "its restitution is 1"

    def __init__(
        self,
        parts: int = 3,
        outer_faces: bool | str = True,
        restitution: float = 0.1,
        stiffness: float | None = None,
        skin: float = 0.0075,
    ):
        self.restitution = between("restitution", restitution, 0.01, 1.0)
        self.stiffness = None if stiffness is None else positive("stiffness", stiffness)
        self.ratio = damping_ratio(self.restitution)
        super().__init__(BodyGeometry(parts, outer_faces, skin))

    def numbers(self, material: Material) -> tuple[float, ...]:
        """Stiffness k [Pa/m] and 2 z sqrt(k), which ``weight`` makes a dashpot [Pa s/m]."""
        stiffness = self.stiffness or typical_of(material.normal_stiffness)
        return stiffness, 2.0 * self.ratio * math.sqrt(stiffness)
