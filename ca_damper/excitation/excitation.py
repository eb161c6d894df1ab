"""Base motion and force of the scenes of a batch."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ca_damper.excitation.signal import Signal
from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, real_numbers, shown, whole


class ExcitationKind(NamedTuple):
    """Compiled structure of an excitation: base "sine" or "signal"; force "none" or as base."""

    base: str = "sine"
    force: str = "none"


@dataclass(frozen=True)
class SineForce:
    """Force on the container, amplitude * sin(2 pi frequency t + phase), upwards.

    Parameters
    ----------
    amplitude : float or sequence of float
        Amplitude [N], one number for all scenes or one for each.
    frequency : float or sequence of float
        Frequency [Hz], likewise.
    phase : float or sequence of float, default 0.0
        Phase [rad], likewise.

    Raises
    ------
    InputError
        A number is not finite, or a frequency is not positive.

    Examples
    --------
    >>> SineForce(amplitude=0.1, frequency=6.0)
    SineForce(amplitude=0.1, frequency=6.0, phase=0.0)
    """

    amplitude: Any
    frequency: Any
    phase: Any = 0.0

    def __post_init__(self) -> None:
        for name in ("amplitude", "frequency", "phase"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name)))
        if min(np.atleast_1d(self.frequency)) <= 0.0:
            raise InputError(f"frequency must be positive, got {shown(self.frequency)}")

    def rows(self, scenes: int) -> np.ndarray:
        """Amplitude, frequency and phase of each scene.

        Parameters
        ----------
        scenes : int
            Number of scenes.

        Returns
        -------
        ndarray
            Amplitude [N], frequency [Hz] and phase [rad], shape (3, scenes).

        Raises
        ------
        InputError
            The numbers are neither one for all scenes nor one for each.
        """
        whole("scenes", scenes, 1, 2**31 - 1)
        values = (self.amplitude, self.frequency, self.phase)
        try:
            return np.stack([np.broadcast_to(one, scenes) for one in map(np.asarray, values)])
        except ValueError:
            raise InputError(
                f"numbers of a SineForce must be one for all or {scenes}, got {shown(self)}"
            ) from None


@dataclass(frozen=True)
class Excitation:
    """Motion of the base and force on the container, for the scenes of a batch.

    Parameters
    ----------
    base : Signal or sequence of Signal, optional
        Displacement of the base [m], one for all scenes or one for each; None for the sine of the
        scenes' table (in ``shake``: a base at rest).
    force : SineForce or Signal or sequence of Signal, optional
        Force on the container [N], upwards; None for no force.

    Raises
    ------
    InputError
        A member is no Signal, or the sequence is empty.
    """

    base: Signal | Sequence[Signal] | None = None
    force: SineForce | Signal | Sequence[Signal] | None = None

    def __post_init__(self) -> None:
        for name in ("base", "force"):
            value = getattr(self, name)
            if isinstance(value, list):
                object.__setattr__(self, name, tuple(value))
            given = value if isinstance(value, (list, tuple)) else (value,)
            plain = value is None or (name == "force" and isinstance(value, SineForce))
            if not plain and not (given and all(isinstance(one, Signal) for one in given)):
                raise InputError(
                    f"{name} must be a Signal, one for each scene, or None, got {shown(value)}"
                )

    @property
    def kind(self) -> ExcitationKind:
        """Kind of base motion and force, which is compiled."""
        base = "sine" if self.base is None else "signal"
        if isinstance(self.force, SineForce):
            return ExcitationKind(base, "sine")
        return ExcitationKind(base, "none" if self.force is None else "signal")

    def signals(self, role: str, scenes: int) -> tuple[Signal, ...]:
        """Signal of each scene for a role.

        Parameters
        ----------
        role : str
            ``"base"`` or ``"force"``.
        scenes : int
            Number of scenes.

        Returns
        -------
        tuple of Signal
            One for each scene; empty where there is none.

        Raises
        ------
        InputError
            The number of signals differs from that of the scenes.
        """
        value = getattr(self, choice("role", role, ("base", "force")))
        whole("scenes", scenes, 1, 2**31 - 1)
        if value is None or isinstance(value, SineForce):
            return ()
        given = (value,) if isinstance(value, Signal) else value
        if len(given) not in (1, scenes):
            raise InputError(f"{role} must be one Signal or {scenes}, got {len(given)}")
        return given * scenes if len(given) == 1 else given

    def sizes(self, scenes: int) -> dict[str, int]:
        """Nodes of all signals, by role.

        Parameters
        ----------
        scenes : int
            Number of scenes.

        Returns
        -------
        dict of int
            Number of nodes by the name of a place in an engine.
        """
        made = {role: self.signals(role, scenes) for role in ("base", "force")}
        return {f"{role}_nodes": len(packed(given)[0]) for role, given in made.items() if given}

    def identity(self) -> str:
        """Words that are the same for equal excitations, whatever their labels.

        Returns
        -------
        str
            Digest of base and force.
        """
        return f"base {_identity(self.base)}, force {_identity(self.force)}"

    def in_words(self) -> tuple[str, ...]:
        """What acts on base and container, and what was done to samples of it.

        Returns
        -------
        tuple of str
            A part of a sentence for each Signal and for a SineForce.
        """
        told = []
        for role, value, unit in (("base", self.base, "m"), ("force", self.force, "N")):
            given = (value,) if isinstance(value, (Signal, SineForce)) else value or ()
            for one in {id(one): one for one in given}.values():
                words = one.in_words(unit) if isinstance(one, Signal) else shown(one)
                told.append(f"{role} {words}")
        return tuple(told)

    def duration(self, scenes: int) -> np.ndarray:
        """Time up to which each scene is excited.

        Parameters
        ----------
        scenes : int
            Number of scenes.

        Returns
        -------
        ndarray
            Time [s], shape (scenes,); infinite for sines.
        """
        ends = np.full(whole("scenes", scenes, 1, 2**31 - 1), np.inf)
        for role in ("base", "force"):
            given = self.signals(role, scenes)
            if given:
                ends = np.minimum(ends, [one.duration for one in given])
        return ends


def excitation_of(value: Any) -> Excitation:
    """Excitation that a user means by a Signal, several of them, an Excitation or None."""
    if isinstance(value, Excitation):
        return value
    if value is None or isinstance(value, (Signal, list, tuple)):
        return Excitation(base=value)
    raise InputError(f"excitation must be a Signal, an Excitation or None, got {shown(value)}")


def packed(given: Sequence[Signal]) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of signals one after the other, each once, and where to find them.

    Returns (value and second derivative, (nodes, 2)) and rows (first node, nodes, step [s]) of each
    signal, (signals, 3).
    """
    first: dict[int, int] = {}
    columns, total = [], 0
    for one in given:
        if id(one) not in first:
            first[id(one)] = total
            columns.append(np.column_stack([one.value, one.bend]))
            total += len(one.value)
    rows = [(first[id(one)], len(one.value), one.step) for one in given]
    return np.concatenate(columns), np.array(rows, dtype=np.float64)


def _identity(value: Any) -> str:
    given = (value,) if isinstance(value, Signal) else value
    if isinstance(given, tuple):
        given = tuple((one.step, one.value, one.bend) for one in given)
    return identity_of(given)


def _numbers(name, value):
    """A float, or a tuple of them; InputError for anything else."""
    numbers = real_numbers(name, value)
    if numbers.ndim > 1 or not numbers.size:
        raise InputError(f"{name} must be one number or one for each scene, got {shown(value)}")
    return float(numbers) if numbers.ndim == 0 else tuple(map(float, numbers))
