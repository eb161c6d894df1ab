"""Base motion and force of the scenes of a batch."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from ca_damper.excitation.signal import Signal
from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import instance, shown


class ExcitationKind(NamedTuple):
    """Compiled structure of an excitation: base "sine" or "signal"; force "none" or "signal"."""

    base: str = "sine"
    force: str = "none"


@dataclass(frozen=True)
class Excitation:
    """Motion of the base and force on the container, for all scenes of a batch.

    Parameters
    ----------
    base : Signal, optional
        Displacement of the base [m]; None: the sine of the table (in ``shake``: a base at rest).
    force : Signal, optional
        Force on the container [N], upwards; None for no force.
    """

    base: Signal | None = None
    force: Signal | None = None

    def __post_init__(self) -> None:
        for role in ("base", "force"):
            if getattr(self, role) is not None:
                instance(role, getattr(self, role), Signal)

    @property
    def kind(self) -> ExcitationKind:
        """Kind of base motion and force, which is compiled."""
        base, force = ("signal" if role in self.signals else "" for role in ("base", "force"))
        return ExcitationKind(base or "sine", force or "none")

    @property
    def signals(self) -> dict[str, Signal]:
        """Signals that there are, by "base" and "force"."""
        both = {"base": self.base, "force": self.force}
        return {role: signal for role, signal in both.items() if signal is not None}

    @property
    def sizes(self) -> dict[str, int]:
        """Number of nodes of each Signal, by the name of a place in an engine."""
        return {f"{role}_nodes": len(signal.value) for role, signal in self.signals.items()}

    @property
    def duration(self) -> float:
        """Time up to which it acts [s]; infinite for sines."""
        return min((signal.duration for signal in self.signals.values()), default=math.inf)

    def identity(self) -> str:
        """Words that are the same for equal excitations, whatever their labels."""
        signals = {
            role: (signal.step, signal.value, signal.bend) for role, signal in self.signals.items()
        }
        return identity_of({"base": self.base, "force": self.force, **signals})

    def in_words(self) -> tuple[str, ...]:
        """Motion of the base and force, and the treatment of samples."""
        units = {"base": "m", "force": "N"}
        return tuple(
            f"{role} {signal.in_words(units[role])}" for role, signal in self.signals.items()
        )


def excitation_of(value: Any) -> Excitation:
    """Excitation that a user means by a Signal, an Excitation or None."""
    if isinstance(value, Excitation):
        return value
    if value is None or isinstance(value, Signal):
        return Excitation(base=value)
    raise InputError(f"excitation must be a Signal, an Excitation or None, got {shown(value)}")
