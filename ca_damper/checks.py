"""Checks of the input of a batch, before its kernels are compiled."""

from typing import Any, Optional

import numpy as np

from ca_damper import measures
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, progress_option, shown, whole

#: Motion of the container at the beginning of a run.
STARTS = ("rest", "empty", "rigid")
MOST_CYCLES = 10_000_000
#: Largest field of measured sums: 1 GiB, half of the most that Taichi can index.
_MOST_NUMBERS = 2**27


def check_run(transient_cycles: Any, start: Any, progress: Any) -> None:
    """Raise InputError for an invalid number of cycles, start or progress."""
    whole("transient_cycles", transient_cycles, 0, MOST_CYCLES)
    choice("start", start, STARTS)
    progress_option("progress", progress)


def check_record_fits(scenes: int, measured_cycles: int) -> None:
    """Raise InputError where so many scenes and cycles exceed the record of measures."""
    cycles = scenes * max(1, measured_cycles)
    most = _MOST_NUMBERS // len(measures.COLUMNS)
    if cycles > most:
        raise InputError(
            f"scenes x measured_cycles must be at most {most} in one batch, got {cycles}: measure "
            "fewer cycles"
        )


def for_all(name: str, value: Any, scenes: int, most: Optional[int] = None) -> np.ndarray:
    """One number for all scenes or one for each, (scenes,); InputError for anything else.

    most: the largest of whole numbers from zero; None for any numbers.
    """
    words, kinds = ("numbers", "iuf") if most is None else (f"whole numbers from 0 to {most}", "iu")
    try:
        given = np.asarray(value)
        numbers = np.broadcast_to(given, scenes)
        bad = given.dtype.kind not in kinds
        bad = bad or (most is not None and bool(((numbers < 0) | (numbers > most)).any()))
    except ValueError:
        bad = True
    if bad:
        raise InputError(f"{name} must be {words}, one for all or {scenes}, got {shown(value)}")
    return numbers
