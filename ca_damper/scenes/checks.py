"""Checks of the input of a batch, before its kernels are compiled."""

from typing import Any

import numpy as np

from ca_damper.excitation.excitation import Excitation, excitation_of
from ca_damper.report import measures
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import (
    choice,
    progress_option,
    real_numbers,
    several,
    shown,
    told_apart,
    whole,
)

#: Motion of the container at the beginning of a run.
STARTS = ("rest", "empty", "rigid")
MOST_CYCLES = 10_000_000
#: Scenes of a run, and the largest seed.
MOST_SCENES, MOST_SEED = 2**24, 2**31 - 1
#: Largest field of measured sums: 1 GiB, half of the most that Taichi can index.
_MOST_NUMBERS = 2**27


def check_run(transient_cycles: Any, measured_cycles: Any, start: Any, progress: Any) -> None:
    """Raise InputError for an invalid number of cycles, start or progress."""
    whole("transient_cycles", transient_cycles, 0, MOST_CYCLES)
    whole("measured_cycles", measured_cycles, 1, 100_000)
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


def for_all(name: str, value: Any, scenes: int, most: int | None = None) -> np.ndarray:
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


def checked_excitation(value: Any, mount: str) -> Excitation:
    """Excitation that a user means; InputError for a force on a container that the base moves."""
    excitation = excitation_of(value)
    if excitation.force is not None and mount == "base":
        raise InputError(
            f"force must be None on the mount {mount!r}, where nothing but the base moves the "
            f"container, got {shown(excitation.force)}"
        )
    return excitation


def checked_samples(value: Any, scenes: int) -> int:
    """Number of samples to record; InputError where those of all scenes find no memory."""
    return whole("recorded_samples", value, 0, _MOST_NUMBERS // (4 * max(1, scenes)))


def starts_of(excitation: Excitation, mount: str) -> tuple[str, ...]:
    """Words for the motion of the container at the beginning: steady ones are those of a spring."""
    return STARTS if excitation == Excitation() and mount in ("spring", "base") else STARTS[:1]


def check_finite_start(initial: np.ndarray) -> None:
    """InputError unless (x, v) of every container, (scenes, 2), are finite numbers."""
    for name, values in zip(("displacement", "velocity"), initial.T):
        real_numbers(name, values)


def check_single_sine(excitation: Excitation, what: str) -> None:
    """InputError for any excitation but a single sine of the base; what: is asked for."""
    if excitation != Excitation():
        raise InputError(
            f"excitation must be None, a single sine of the base, for {what}, got "
            f"{shown(excitation)}"
        )


def check_within(excitation: Excitation, ends: np.ndarray) -> None:
    """InputError where a run to times ``ends`` [s], (scenes,), goes beyond its excitation."""
    s = int(np.argmax(ends))
    if ends[s] > excitation.duration * (1.0 + 1e-9):
        got, most = told_apart(ends[s], excitation.duration)
        raise InputError(
            f"a run must end within its excitation of {most} s, got {got} s in scene {s}: run "
            "fewer cycles, or shorter windows"
        )


def run_seeds(seeds: Any) -> tuple[int, ...]:
    """Seeds given as their number or one by one; InputError."""
    if not hasattr(seeds, "__iter__") or isinstance(seeds, (str, bytes, dict)):
        seeds = range(1, whole("seeds", seeds, 1, 1_000_000) + 1)
    return several("seeds", seeds, lambda name, x: whole(name, x, 0, MOST_SEED))
