"""Cracks of a block in sections, which two pages draw."""

import numpy as np


def crossings(triangles, normal, place):
    """Where triangles (n, 3, 3) [m] cross the plane at a place on an axis.

    Returns the ends of the lines (m, 2, 3) [m] and which triangle each belongs to (m,). One with a
    corner in the plane counts as lying above it.
    """
    above = triangles[..., normal] >= place
    which = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    crossed, above = triangles[which], above[which]
    # The corner that lies alone on its side: both lines that cross start there.
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows, ends = np.arange(len(which)), []
    first = crossed[rows, alone]
    for k in (1, 2):
        end = crossed[rows, (alone + k) % 3]
        share = (place - first[:, normal]) / (end[:, normal] - first[:, normal])
        ends.append(first + share[:, None] * (end - first))
    return np.stack(ends, axis=1), which
