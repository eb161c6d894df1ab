"""Certificate of a run: what acted, was left out or is periodic, and the range that was checked."""

from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ca_damper.report.measures import Cycles
from ca_damper.report.steady_state import period
from taichi_dem.kit.display import counted
from taichi_dem.kit.effect_table import BaseCertificate, Estimate

#: Words for which effects of a filling are computed: those that its options list, or those that an
#: estimate before the run calls for.
EFFECTS = ("listed", "auto")
#: Difference of cycles up to which they are alike, as a share of the first harmonic.
ALIKE = 1e-3
#: Share of the momentum exchanged that may be missing; rounding makes less than 1e-9.
CLOSED = 1e-6


@dataclass(frozen=True)
class Periods:
    """Scenes in a periodic state, in which all measured cycles are alike.

    Parameters
    ----------
    cycles : int
        Number of measured cycles.
    tolerance : float
        Largest difference of the motion of cycles, as a share of it.
    scenes : tuple of tuple of (int, int)
        (period in cycles, number of scenes) for each period.
    others : int
        Number of scenes without a period.
    """

    cycles: int
    tolerance: float
    scenes: tuple[tuple[int, int], ...]
    others: int

    def __str__(self) -> str:
        test = f"first harmonic of {self.cycles} cycles within {100.0 * self.tolerance:.2g} %"
        every = {p: "every cycle" if p == 1 else f"every {p} cycles" for p, _ in self.scenes}
        words = [f"{counted(n, 'scene')} {every[p]}" for p, n in self.scenes]
        return f"{', '.join(words) or 'no scene'}, {counted(self.others, 'scene')} never ({test})"


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
        finding = f"outside: {'; '.join(self.outside)}" if self.outside else "inside"
        open_part = "" if self.knows_motion else ", except the motion, which was not checked"
        return f"{finding}{open_part}"


@dataclass(frozen=True, kw_only=True, repr=False)
class Certificate(BaseCertificate):
    """Effects computed and left out in a run, with estimates.

    Parameters
    ----------
    acting : tuple of EffectUse, default ()
        Activity of each effect that was computed, and from when, as far as the filling counts it.
    left_out : tuple of Estimate, default ()
        Estimated size of each effect that was not computed.
    warnings : tuple of str, default ()
        What lies outside of the checked range, and scenes that diverged.
    effects : str
        ``"listed"`` or ``"auto"``, as asked for.
    estimates : tuple of Estimate, default ()
        Estimates of the effects that ``"auto"`` decided on.
    periods : Periods, optional
        Periodicity of the motion; None where fewer than two cycles were measured.
    checked : CheckedRange, optional
        Range in which the filling was checked, and what of the run lies outside; None: no range.
    """

    effects: str
    estimates: tuple[Estimate, ...] = ()
    periods: Periods | None = None
    checked: CheckedRange | None = None

    def left_out_lines(self) -> list[str]:
        """What was left out, and what is periodic, in lines."""
        skipping = (use for use in self.acting if use.skipped)
        return [
            *(f"estimated: {estimate}" for estimate in self.estimates),
            *super().left_out_lines(),
            *(f"{use.effect}: {use.skipped:,} tests skipped" for use in skipping),
            *([] if self.periods is None else [f"periodic: {self.periods}"]),
        ]

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file."""
        return {
            "effects": self.effects,
            **super().as_dict(),
            "estimates": [estimate.as_dict() for estimate in self.estimates],
            "periods": self.periods and asdict(self.periods),
        }


class Driven(NamedTuple):
    """What is known of scenes before they run, (scenes,) each.

    particles: numbers. mass: of what a blow moves [kg], infinite for a container that is driven.
    amplitude [m] and acceleration [m/s^2] of a container driven by a sine of its base, else NaN.
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
    particles, size, frequency = map(
        batch.table.column, ("particles", "base_amplitude", "frequency")
    )
    if batch.mount != "base" or batch.excitation.kind.base != "sine":
        size = np.full(batch.count, np.nan)
    mass = batch.support.masses(batch.table)
    driven = particles, mass, size, size * (2.0 * np.pi * frequency) ** 2
    ranges: list[CheckedRange] = [
        kind.checked_range(Driven(*(of_all[which == k] for of_all in driven)))
        for k, kind in enumerate(kinds)
    ]
    outside = tuple(dict.fromkeys(words for checked in ranges for words in checked.outside))
    warning = "; ".join(dict.fromkeys(checked.warning for checked in ranges if checked.warning))
    return CheckedRange(ranges[0].words, outside, warning, bool((size > 0.0).all()))


def certificate_of(batch: Any, momentum_error: float) -> Certificate:
    """Certificate of a batch since its start: the table of its effects."""
    checked, diverged = checked_range(batch), len(batch.divergences())
    outside = () if checked is None else checked.outside
    gone = [f"{counted(diverged, 'scene')} diverged"] if diverged else []
    # A filling without an order leaves impulses out, and says so.
    if getattr(batch.fillings.kinds[0], "order", None) is not None and momentum_error > CLOSED:
        gone.append(f"momentum closes only to {100.0 * momentum_error:.2g} %: a blow is not booked")
    return Certificate(
        effects=batch.asked_effects,
        acting=tuple(_uses(batch)),
        left_out=batch.fillings.left_out(batch.most_particles),
        estimates=batch.estimates,
        periods=batch.periods,
        checked=checked,
        warnings=(*(f"outside of the checked range, {words}" for words in outside), *gone),
    )


def _uses(batch):
    """Activity of each effect, and when [s] and where it began as far as the filling notes it."""
    device, effects = batch.device, batch.fillings.kinds[0].effects
    first = device.first_steps(effects) if hasattr(device, "first_steps") else {}
    for use in device.uses(effects):
        steps = first.get(use.effect, np.full(batch.count, np.inf))
        times = batch.time_origin + steps * batch.table.column("dt")
        scene = int(times.argmin())
        begun = {"since_s": float(times[scene]), "where": f"scene {scene}"}
        yield replace(use, **begun) if np.isfinite(times[scene]) else use


def periods_of(cycles: Cycles) -> Periods | None:
    """Which scenes are periodic over the measured cycles; None for fewer than two."""
    measured = cycles.record.shape[1]
    if measured < 2:
        return None
    series = cycles.harmonic_by_cycle("x")
    periods = [period(values, ALIKE) for values in series if np.isfinite(values).all()]
    lengths, counts = np.unique([values for values in periods if values], return_counts=True)
    pairs = tuple(zip(map(int, lengths), map(int, counts)))
    return Periods(measured, ALIKE, pairs, len(periods) - int(counts.sum()))
