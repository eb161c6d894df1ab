"""Range in which a filling was checked, and what of the scenes of a batch lies outside it."""

import warnings
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional

import numpy as np


@dataclass(frozen=True)
class CheckedRange:
    """Where the numbers of a filling were compared with others, and whether a run is inside.

    Parameters
    ----------
    words : str
        The range, and how well the numbers agree in it.
    outside : tuple of str, default ()
        What of the scenes lies outside.
    warning : str, default ""
        Sentence before a run where the filling is known to fail.
    """

    words: str
    outside: tuple[str, ...] = ()
    warning: str = ""

    def rows(self) -> list[tuple[str, str]]:
        """Lines of the report.

        Returns
        -------
        list of (str, str)
            Name and text of each.
        """
        found = "; ".join(self.outside)
        return [("checked with", self.words), ("", f"outside: {found}" if found else "inside")]


class Driven(NamedTuple):
    """What is known of scenes before they run, (scenes,) each.

    particles: numbers. mass: of the container [kg], infinite where it is part of a structure.
    amplitude [m] and acceleration [m/s^2] of a container that moves as a sine of its base, NaN of
    others.
    """

    particles: np.ndarray
    mass: np.ndarray
    amplitude: np.ndarray
    acceleration: np.ndarray


def checked_range(batch: Any) -> Optional[CheckedRange]:
    """Of a batch; None where its filling names no range."""
    if not hasattr(batch.filling, "checked_range"):
        return None
    particles, mass, size, frequency = map(
        batch.table.column, ("particles", "mass", "base_amplitude", "frequency")
    )
    if batch.modal is not None:
        mass = np.full(batch.count, np.inf)
    if batch.mount != "base" or batch.excitation.kind.base != "sine":
        size = np.full(batch.count, np.nan)
    driven = Driven(particles, mass, size, size * (2.0 * np.pi * frequency) ** 2)
    found: CheckedRange = batch.filling.checked_range(driven)
    return found


def warn_outside(batch: Any) -> None:
    """A UserWarning where the filling of a batch is known to fail on its scenes."""
    found = checked_range(batch)
    if found is not None and found.warning:
        warnings.warn(found.warning, stacklevel=3)
