"""Range in which a filling was checked, and scenes of a batch outside it."""

import warnings
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np


@dataclass(frozen=True)
class CheckedRange:
    """Range in which the numbers of a filling were compared, and whether a run is inside.

    Parameters
    ----------
    words : str
        The range, and the agreement in it.
    outside : tuple of str, default ()
        What of the scenes lies outside.
    warning : str, default ""
        Sentence before a run where the filling is known to fail.
    knows_motion : bool, default True
        Whether the motion of all containers is known before they run.
    """

    words: str
    outside: tuple[str, ...] = ()
    warning: str = ""
    knows_motion: bool = True

    @property
    def finding(self) -> str:
        """What of the scenes lies outside, in words."""
        found = f"outside: {'; '.join(self.outside)}" if self.outside else "inside"
        open_part = "" if self.knows_motion else ", except the motion, which was not checked"
        return f"{found}{open_part}"


class Driven(NamedTuple):
    """What is known of scenes before they run, (scenes,) each.

    mass: of what a blow moves, infinite for a driven container. amplitude, acceleration: of a
    container that moves as a sine of its base, NaN of others.
    """

    particles: np.ndarray
    mass: np.ndarray
    amplitude: np.ndarray
    acceleration: np.ndarray


def checked_range(batch: Any) -> CheckedRange | None:
    """Of a batch; None where its fillings name no range."""
    kinds, which = batch.fillings.kinds, batch.fillings.which
    if not hasattr(kinds[0], "checked_range"):
        return None
    particles, mass, size, frequency = map(
        batch.table.column, ("particles", "mass", "base_amplitude", "frequency")
    )
    if batch.modal is not None:
        places = np.resize(batch.modal.scene_places, batch.count)
        recoils = np.array([batch.modal.structure.recoil(place) for place in places])
        # Where nothing moves it is infinite.
        mass = 1.0 / np.maximum(recoils, 1e-300)
    elif batch.mount == "base":
        mass = np.full(batch.count, np.inf)
    if batch.mount != "base" or batch.excitation.kind.base != "sine":
        size = np.full(batch.count, np.nan)
    driven = particles, mass, size, size * (2.0 * np.pi * frequency) ** 2
    found: list[CheckedRange] = [
        kind.checked_range(Driven(*(of_all[which == k] for of_all in driven)))
        for k, kind in enumerate(kinds)
    ]
    outside = tuple(dict.fromkeys(words for one in found for words in one.outside))
    warning = "; ".join(dict.fromkeys(one.warning for one in found if one.warning))
    return CheckedRange(found[0].words, outside, warning, bool((size > 0.0).all()))


def warn_outside(batch: Any) -> None:
    """A UserWarning where the fillings of a batch are known to fail on its scenes."""
    found = checked_range(batch)
    if found is not None and found.warning:
        warnings.warn(found.warning, stacklevel=3)
