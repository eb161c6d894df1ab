"""Which frames a page holds, so that it stays small enough to open."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import told_apart

#: Largest page [bytes].
MOST_BYTES = 30_000_000
#: Letters of base64 for a byte.
_BASE64 = 4.0 / 3.0


def select_frames(
    frames: Sequence[Any], finite: Sequence[bool], frame_bytes: int, other_bytes: int
) -> tuple[list[Any], list[str]]:
    """Select the frames that a page holds.

    Parameters
    ----------
    frames : sequence
        All of them, in order.
    finite : sequence of bool
        Whether each holds finite numbers only; others are left out.
    frame_bytes, other_bytes : int
        Packed size of a frame, and of all else, before base64.

    Returns
    -------
    list
        All finite frames, or some of them, evenly up to the last, where a page of all would
        exceed ``MOST_BYTES``.
    list of str
        Sentences on what is left out.

    Raises
    ------
    InputError
        If no frame is left, or a page of two would be too large.
    """
    notes, kept = [], [frame for frame, good in zip(frames, finite) if good]
    if not kept:
        raise InputError("frames must hold at least one finite snapshot, got none")
    if len(kept) < len(frames):
        notes.append(f"{counted(len(frames) - len(kept), 'frame')} with infinite values left out.")
    most = int((MOST_BYTES / _BASE64 - other_bytes) // max(1, frame_bytes))
    if most < 2:
        size = _BASE64 * (2 * frame_bytes + other_bytes) / 1e6
        got, room = told_apart(size, MOST_BYTES / 1e6)
        raise InputError(f"scene must fit a page of {room} MB, got {got} MB for two frames")
    if len(kept) > most:
        notes.append(
            f"{most:,} of {len(kept):,} frames shown: a page has at most {MOST_BYTES // 10**6} MB."
        )
        kept = [kept[k] for k in np.linspace(0, len(kept) - 1, most).round().astype(int)]
    return kept, notes
