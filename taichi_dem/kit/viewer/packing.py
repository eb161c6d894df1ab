"""Arrays as text for a page: little-endian, in base64, of few bits where few are enough."""

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

#: Largest magnitude of a quantised value.
_MOST = 32767
_UNITS = (("s", 1.0), ("ms", 1e3), ("µs", 1e6), ("ns", 1e9))


def pack(values: Any, kind: str) -> dict[str, Any]:
    """Pack an array for a page.

    Parameters
    ----------
    values : array_like
        Numbers of any shape; NaN is allowed where kind is "float32".
    kind : str
        NumPy name of the type they get: "uint8", "int16", "uint32", "float32", ...

    Returns
    -------
    dict
        kind, and data: the bytes in C order, little-endian, in base64.
    """
    made = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return {"kind": kind, "data": base64.b64encode(made.tobytes()).decode("ascii")}


def quantise(frames: Sequence[np.ndarray]) -> dict[str, Any]:
    """Pack arrays of equal size as 16-bit whole numbers, each with a scale of its own.

    Parameters
    ----------
    frames : sequence of ndarray
        Finite arrays, one a frame.

    Returns
    -------
    dict
        As of ``pack``, with scale: (frames,). A value is the whole number times the scale of its
        frame, and differs from the original by at most half the scale, which is the largest
        magnitude of the frame over 32767.
    """
    rows = np.array([np.ravel(frame) for frame in frames], dtype=float)
    scale = np.abs(rows).max(axis=1, initial=0.0) / _MOST
    whole = np.rint(rows / np.where(scale > 0.0, scale, 1.0)[:, None])
    return {**pack(whole, "int16"), "scale": scale.tolist()}


def time_unit(until: float) -> tuple[str, float]:
    """Unit in which a time [s] is at least one, from s to ns, and how many of it a second has."""
    found = (unit for unit in _UNITS if until * unit[1] >= 1.0)
    return next(found, _UNITS[-1])
