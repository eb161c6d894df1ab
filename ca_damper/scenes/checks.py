"""Checks of the input of a batch, before its kernels are compiled."""

import numpy as np

from ca_damper.excitation.excitation import Excitation, excitation_of
from taichi_dem.kit.display import listed
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
# Samples a period by which a resonance is followed to 0.1 %.
_ENOUGH = 8


def check_run(
    transient_cycles: object, measured_cycles: object, start: object, progress: object
) -> None:
    """Raise InputError for an invalid number of cycles, start or progress."""
    whole("transient_cycles", transient_cycles, 0, MOST_CYCLES)
    whole("measured_cycles", measured_cycles, 1, 100_000)
    choice("start", start, STARTS)
    progress_option("progress", progress)


def for_all(name: str, value: object, scenes: int, most: int | None = None) -> np.ndarray:
    """One number for all scenes or one for each, (scenes,); InputError for anything else."""
    given = real_numbers(name, value)
    words = "numbers" if most is None else f"whole numbers from 0 to {most}"
    is_whole = most is None or ((given >= 0) & (given <= most) & (given == np.floor(given))).all()
    if not is_whole or given.shape not in ((), (1,), (scenes,)):
        raise InputError(f"{name} must be {words}, one for all or {scenes}, got {shown(value)}")
    return np.broadcast_to(given, scenes)


def checked_excitation(value: object, mount: str) -> Excitation:
    """Excitation that a user means; InputError for a force on a container that the base moves."""
    excitation = excitation_of(value)
    if excitation.force is not None and mount == "base":
        raise InputError(
            f"force must be None on the mount {mount!r}, where nothing but the base moves the "
            f"container, got {shown(excitation.force)}"
        )
    return excitation


def starts_of(excitation: Excitation, mount: str) -> tuple[str, ...]:
    """Words for the motion of the container at the beginning: steady ones are those of a spring."""
    return STARTS if excitation == Excitation() and mount in ("spring", "base") else STARTS[:1]


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


def sampling_found(excitation: Excitation, frequencies: np.ndarray) -> tuple[str, ...]:
    """Sentences on samples too few for frequencies of a structure; InputError for long gaps."""
    sentences, highest = [], float(frequencies.max(initial=0.0))
    for role, signal in excitation.signals.items():
        if 4.0 * signal.gap * highest > 1.0:
            got, most = told_apart(signal.gap, 0.25 / highest)
            raise InputError(
                f"gaps of the {role} must be at most {most} s, a quarter of the structure's period "
                f"at {highest:.4g} Hz, got {got} s in {signal.label}"
            )
        few = np.unique(frequencies[frequencies * signal.apart * _ENOUGH > 1.0 + 1e-9])
        if len(few):
            sentences.append(
                f"{role} has fewer than {_ENOUGH} samples a period above "
                f"{1.0 / (_ENOUGH * signal.apart):.4g} Hz, as the structure has at "
                f"{listed(few.tolist())} Hz: its motion there may be off by more than 0.1 %"
            )
    return tuple(sentences)


def run_seeds(seeds: object) -> tuple[int, ...]:
    """Seeds given as their number or one by one; InputError."""
    if not hasattr(seeds, "__iter__") or isinstance(seeds, (str, bytes, dict)):
        seeds = range(1, whole("seeds", seeds, 1, 1_000_000) + 1)
    return several("seeds", seeds, lambda name, x: whole(name, x, 0, MOST_SEED))
