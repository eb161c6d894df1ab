"""Linear algebra of stacks of small matrices whose bits are the same on every processor."""

import numpy as np

#: Sweeps of ``largest_eigenvalues``: a 6x6 matrix is diagonal to the last bit after six.
_SWEEPS = 7
#: Matrices taken at a time, so that they stay in the cache.
_AT_A_TIME = 4096
_TINY = 1e-300


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Sum of a b over the last axis, from the first entry to the last."""
    total = a[..., 0] * b[..., 0]
    for k in range(1, a.shape[-1]):
        total = total + a[..., k] * b[..., k]
    return total


def length(vectors: np.ndarray) -> np.ndarray:
    """Euclidean lengths of vectors along the last axis."""
    return np.sqrt(dot(vectors, vectors))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of vectors along the last axis, with ``members_last``."""
    components = [
        a[..., k] * b[..., m] - a[..., m] * b[..., k] for k, m in ((1, 2), (2, 0), (0, 1))
    ]
    return np.moveaxis(np.array(components), 0, -1)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Matrix products of stacks of matrices, a (..., n, m) and b (..., m, k)."""
    total = a[..., :, :1] * b[..., :1, :]
    for k in range(1, a.shape[-1]):
        total = total + a[..., :, k : k + 1] * b[..., k : k + 1, :]
    return total


def members_last(stack: np.ndarray) -> np.ndarray:
    """The same stack, with equal entries of its members side by side in memory."""
    # Loops over members are then long: products of 1700 matrices take a fifth of the time.
    return np.moveaxis(np.ascontiguousarray(np.moveaxis(stack, 0, -1)), -1, 0)


def transposed(matrices: np.ndarray) -> np.ndarray:
    """Transposes of a stack of matrices."""
    return np.swapaxes(matrices, -1, -2)


def inverse_factor(matrices: np.ndarray) -> np.ndarray:
    """W with W^T W = A^-1 of symmetric positive definite A, shape (n, m, m); lower triangular."""
    size = matrices.shape[-1]
    rest, inverse = matrices.copy(), np.zeros_like(matrices)
    inverse[:, range(size), range(size)] = 1.0
    for k in range(size):
        pivot = rest[:, k, k]
        for i in range(k + 1, size):
            share = (rest[:, i, k] / pivot)[:, None]
            rest[:, i] = rest[:, i] - share * rest[:, k]
            inverse[:, i] = inverse[:, i] - share * inverse[:, k]
    return inverse / np.sqrt(np.diagonal(rest, axis1=1, axis2=2))[:, :, None]


def inverse(matrices: np.ndarray) -> np.ndarray:
    """Inverses of symmetric positive definite matrices, (n, m, m); symmetric to the last bit."""
    factor = inverse_factor(matrices)
    return product(transposed(factor), factor)


def parts_in_cache(count: int) -> list[slice]:
    """Slices of ``count`` matrices, each of which stays in the cache of a processor."""
    return [slice(first, first + _AT_A_TIME) for first in range(0, count, _AT_A_TIME)]


def largest_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Largest eigenvalue of every symmetric matrix, shape (n, m, m)."""
    parts = [_diagonal(matrices[part]) for part in parts_in_cache(len(matrices))]
    return np.concatenate([np.empty(0), *(values.max(axis=0) for values in parts)])


def weakest_direction(matrix: np.ndarray) -> np.ndarray:
    """Unit eigenvector of the smallest eigenvalue of a symmetric matrix, shape (m, m)."""
    axes = np.eye(len(matrix))[:, :, None]
    values = _diagonal(matrix[None], axes)
    return axes[:, values[:, 0].argmin(), 0]


def _diagonal(matrices, *axes):
    """Eigenvalues (m, n) by Jacobi's rotations; axes: unit matrices (m, m, n) that turn along."""
    a = np.moveaxis(matrices, 0, -1).copy()
    size = range(len(a))
    for _ in range(_SWEEPS):
        for p in size:
            for q in size[p + 1 :]:
                _rotate(a, axes, p, q)
    return a[size, size]


def _rotate(a, axes, p, q):
    """Turn the axes p and q of matrices (m, m, n) such that their entry (p, q) vanishes."""
    # Golub and Van Loan, Matrix Computations, algorithm 8.4.1.
    twice, apart = 2.0 * a[p, q], a[q, q] - a[p, p]
    # A denominator of zero belongs to an entry that has vanished.
    root = np.abs(apart) + np.sqrt(apart * apart + twice * twice) + _TINY
    t = np.where(apart < 0.0, -twice, twice) / root
    c = 1.0 / np.sqrt(1.0 + t * t)
    s = t * c
    _turn(a[p], a[q], c, s)
    for columns in (a, *axes):
        _turn(columns[:, p], columns[:, q], c, s)


def _turn(first, second, c, s):
    turned = s * first
    turned += c * second
    first *= c
    first -= s * second
    second[:] = turned
