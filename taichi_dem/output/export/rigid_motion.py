"""Rigid motion of fragments: the translation and rotation that fit their bodies best."""

import numpy as np

from taichi_dem.output.fragments import centres, sums
from taichi_dem.output.record import Frame
from taichi_dem.state.model import Model


def rigid_motion(model: Model, frame: Frame, of_body: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place and rotation of fragments in a frame.

    Parameters
    ----------
    model : Model
    frame : Frame
    of_body : ndarray of int, shape (body_count,)
        Fragment of each body.

    Returns
    -------
    centre : ndarray, shape (fragments, 3)
        Of mass [m].
    rotation : ndarray, shape (fragments, 3, 3)
        From the shape at rest; of least squares over all points of the bodies, weighted by mass.

    Notes
    -----
    The rotation nearest to the moment matrix of places now and at rest (W. Kabsch, Acta Cryst. A32,
    1976, 922-923); each body adds its own second moment, so that one alone has its own rotation.
    """
    mass = model.body_mass
    rest = model.centre - centres(of_body, mass, model.centre)[of_body]
    centre = centres(of_body, mass, frame.position)
    arm = frame.position - centre[of_body]
    trace = np.trace(model.body_inertia, axis1=1, axis2=2)
    second = 0.5 * trace[:, None, None] * np.eye(3) - model.body_inertia
    moved = mass[:, None, None] * arm[:, :, None] * rest[:, None, :]
    left, _, right = np.linalg.svd(sums(of_body, moved + frame.rotation @ second))
    # A reflection that fits better is no rotation: its weakest axis is turned round.
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return centre, left @ right


def quaternions_of(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternions, scalar first, of rotation matrices (n, 3, 3); (n, 4).

    Four formulas differ in the component that they divide by; the largest is taken (S. W. Shepperd,
    J. Guidance and Control 1, 1978, 223-224).
    """
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(rotation, 0, -1)
    x, y, z = h - f, c - g, d - b
    candidates = np.array(
        [
            (1.0 + a + e + i, x, y, z),
            (x, 1.0 + a - e - i, b + d, c + g),
            (y, b + d, 1.0 - a + e - i, f + h),
            (z, c + g, f + h, 1.0 - a - e + i),
        ]
    )
    best = np.einsum("kkn->kn", candidates).argmax(axis=0)
    found = candidates[best, :, np.arange(len(best))]
    return found / np.linalg.norm(found, axis=1)[:, None]
