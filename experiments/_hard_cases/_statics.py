"""Statics of an arch of rigid wedges: the least friction at which it stands."""

import numpy as np


def least_friction(stones, accuracy=1e-4):
    """Least friction coefficient with which wedges in a row can stand.

    stones: polygons (n, 4, 2) of one thickness, corners (up, along): 0 and 1 on the joint with the
    stone before, 3 and 2 on that with the stone after; gravity acts against the first coordinate.
    Found by bisection: at each end of each joint some force within the cone of friction holds all
    stones (Livesley, Int. J. Numer. Meth. Engng. 12 (1978) 1853).
    """
    low, high = 0.0, 2.0
    while high - low > accuracy:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _stand(stones, middle) else (middle, high)
    return high


def _stand(stones, friction):
    """Whether forces exist that hold all stones."""
    from scipy.optimize import linprog

    count = len(stones)
    rows, weight = np.zeros((count, 3, count + 1, 4)), np.zeros((count, 3))
    for k, corners in enumerate(stones):
        area, centre = _area(corners)
        weight[k, 0] = area
        for joint, ends, sign in ((k, corners[[0, 1]], 1.0), (k + 1, corners[[3, 2]], -1.0)):
            along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            across = np.array([along[1], -along[0]])
            edges = across + friction * along, across - friction * along
            force = sign * np.repeat(edges, 2, axis=0)
            arm = np.tile(ends, (2, 1)) - centre
            rows[k, :2, joint] = force.T
            rows[k, 2, joint] = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    whole = rows.reshape(3 * count, -1)
    found = linprog(np.zeros(whole.shape[1]), A_eq=whole, b_eq=weight.ravel(), bounds=(0, None))
    return found.status == 0


def _area(corners):
    """Area of a polygon (positive from the first coordinate to the second), and its centre."""
    x, y = corners.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    next_too = corners + np.roll(corners, -1, axis=0)
    return abs(cross.sum()) / 2.0, (next_too * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())
