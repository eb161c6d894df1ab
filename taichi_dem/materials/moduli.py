"""Moduli of bonds for a wanted Young's modulus and Poisson's ratio, and back.

Bonds have the normal stiffness E_n / h and the tangential one E_t / h per area, h the distance of
the two bodies along the normal. In a tessellation the sum of area times h over the bonds is three
volumes, and with normals in all directions alike two mean fields bound the moduli:

  displacements affine, rotations none:  3 K = E_n,  10 G = 2 E_n + 3 E_t,
  tractions uniform, t = sigma n:        3 K = E_n,  1 / G = 4 / (5 E_n) + 6 / (5 E_t).

The first is E_n = E / (1 - 2 nu), E_t / E_n = (1 - 4 nu) / (1 + nu) of microplanes and reaches only
nu <= 1/4 (Bazant and Oh, J. Eng. Mech. 111 (1985) 559). Tetrahedra follow the second to a tenth,
since four faces leave a body little to carry but a uniform stress: uniform tractions are in
equilibrium with every tetrahedron, a lower bound of the stiffness. What they carry beyond it
(``_MEASURED``) was found by periodic cells of random tetrahedra, solved in statics.
"""

from __future__ import annotations

import math

import numpy as np

from taichi_dem.kit.validation import between, positive

#: E_t / E_n, then 3 K / E_n and G over that of uniform tractions: means over five periodic Delaunay
#: meshes of 990 to 1900 tetrahedra about points that repel each other, which differ among each
#: other by up to SPREAD.
_MEASURED = np.array(
    [
        [0.02, 1.0023, 1.2093],
        [0.04, 1.0044, 1.1891],
        [0.08, 1.0082, 1.1587],
        [1.0 / 6.0, 1.0150, 1.1172],
        [0.25, 1.0205, 1.0931],
        [0.35, 1.0261, 1.0748],
        [0.5, 1.0332, 1.0591],
        [0.7, 1.0408, 1.0496],
        [1.0, 1.0499, 1.0469],
        [1.5, 1.0610, 1.0541],
        [2.5, 1.0753, 1.0784],
        [4.0, 1.0879, 1.1123],
    ]
)
#: Largest deviation of E of one of these meshes from the mean, as a share, and of nu.
SPREAD = 0.03, 0.002
#: Poisson's ratios from the least to the largest that bonds give with ratios of stiffness in use.
POISSON = -0.2, 0.45


def bond_moduli(young: float, poisson: float) -> tuple[float, float]:
    """Normal and tangential modulus E_n, E_t of bonds [Pa] for E [Pa] and Poisson's ratio.

    Raises InputError for a modulus that is not positive, or a Poisson's ratio out of reach.
    """
    young, poisson = positive("young", young), between("poisson", poisson, *POISSON)
    ratio = _ratio_of(poisson)
    normal = young / _constants_at(ratio)[0]
    return normal, ratio * normal


def elastic_constants(normal: float, shear: float) -> tuple[float, float]:
    """Young's modulus [Pa] and Poisson's ratio for the moduli E_n, E_t of bonds [Pa].

    Raises InputError for moduli that are not positive or whose ratio is not in the table.
    """
    normal, shear = positive("normal", normal), positive("shear", shear)
    least, most = float(_MEASURED[0, 0]), float(_MEASURED[-1, 0])
    young, poisson = _constants_at(between("shear / normal", shear / normal, least, most))
    return normal * young, poisson


def _constants_at(ratio):
    """E / E_n and Poisson's ratio at a ratio E_t / E_n."""
    place = np.log(_MEASURED[:, 0])
    bulk, shear = (float(np.interp(np.log(ratio), place, _MEASURED[:, k])) for k in (1, 2))
    bulk, shear = bulk / 3.0, shear / (0.8 + 1.2 / ratio)
    poisson = (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear)
    return 9.0 * bulk * shear / (3.0 * bulk + shear), poisson


def _ratio_of(poisson):
    """E_t / E_n that gives a Poisson's ratio, which falls as it grows: by bisection."""
    low, high = float(_MEASURED[0, 0]), float(_MEASURED[-1, 0])
    for _ in range(60):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if _constants_at(middle)[1] > poisson else (low, middle)
    return middle
