"""Certificate of a run: when effects first acted, what was left out, what an audit found."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from taichi_dem.kit.audit import Audit
from taichi_dem.kit.display import counted, in_brief

#: Words for which effects of a filling are computed: those that its options list, or those that an
#: estimate before the run calls for.
EFFECTS = ("listed", "auto")
#: Verdicts of an estimate.
NEGLIGIBLE, UNCLEAR, NEEDED = "negligible", "unclear", "needed"
#: What makes all contact tests.
_REMEDY = "run it with search='cells', which skips no contact test"
#: Shares below which an effect is negligible, and from which on it is needed.
_NEGLIGIBLE, _NEEDED = 1e-3, 1e-2


@dataclass(frozen=True)
class Estimate:
    """Size of an effect, estimated before a run.

    Parameters
    ----------
    effect : str
        Name of the effect.
    share : float
        Upper bound of its size, as a share of ``whole``; 0 is exact.
    whole : str
        What the share is of, in words.
    reason : str
        Where the estimate comes from.
    """

    effect: str
    share: float
    whole: str
    reason: str

    @property
    def verdict(self) -> str:
        """Verdict of the share: "negligible", "needed" or "unclear", which is computed."""
        if self.share < _NEGLIGIBLE:
            return NEGLIGIBLE
        return NEEDED if self.share >= _NEEDED else UNCLEAR

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        return {**asdict(self), "verdict": self.verdict}

    def __str__(self) -> str:
        size = (
            f"at most {100.0 * self.share:.2g} % of {self.whole}" if self.share else "exactly none"
        )
        return f"{self.verdict}, {size}: {self.reason}"


@dataclass(frozen=True)
class Onset:
    """Scenes in which an effect acted, and the time when it first did.

    Parameters
    ----------
    effect : str
        Name of the effect.
    scenes : int
        Number of scenes.
    since_s : float or None
        Time [s]; None if it never acted.
    """

    effect: str
    scenes: int
    since_s: float | None

    def __str__(self) -> str:
        if self.since_s is None:
            return f"{self.effect}: never acted"
        return f"{self.effect}: in {counted(self.scenes, 'scene')} from {self.since_s:.4g} s"


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
        found = [f"{counted(n, 'scene')} {every[p]}" for p, n in self.scenes]
        return f"{', '.join(found) or 'none'}, {self.others} not periodic ({test})"


@dataclass(frozen=True)
class Certificate:
    """What was computed, what was left out, and how that is known.

    Parameters
    ----------
    effects : str
        ``"listed"`` or ``"auto"``, as asked for.
    scenes : int
        Number of scenes of the run.
    onsets : tuple of Onset, default ()
        For each effect that was computed, when it first acted, as far as the filling counts it.
    left_out : tuple of Estimate, default ()
        Estimated size of each effect that was not computed.
    estimates : tuple of Estimate, default ()
        Estimates of the effects that ``"auto"`` decided on.
    audit : Audit, optional
        Audit of contact tests that were skipped; None where none were.
    periods : Periods, optional
        Periodicity of the motion; None where fewer than two cycles were measured.
    """

    effects: str
    scenes: int
    onsets: tuple[Onset, ...] = ()
    left_out: tuple[Estimate, ...] = ()
    estimates: tuple[Estimate, ...] = ()
    audit: Audit | None = None
    periods: Periods | None = None

    @property
    def failure(self) -> str:
        """Why the certificate does not hold, and what would settle it; ``""`` where it holds."""
        missed = "" if self.audit is None else self.audit.failure
        return missed and f"the certificate does not hold, as {missed}: {_REMEDY}"

    @property
    def holds(self) -> bool:
        """Whether no audit found a miss."""
        return not self.failure

    def rows(self) -> list[tuple[str, str]]:
        """Lines of a report.

        Returns
        -------
        list of tuple
            (name, text) of each line.
        """
        found = [("acted", str(one)) for one in self.onsets]
        found += [("left out", f"{one.effect}, {one}") for one in self.left_out]
        found += [("estimated", f"{one.effect}, {one}") for one in self.estimates]
        audit = self.audit if self.audit is not None and self.audit.skipped else None
        found += [("audit", str(audit))] if audit else []
        found += [("", self.failure)] if self.failure else []
        found += [("periodic", str(self.periods))] if self.periods is not None else []
        return found

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        figures = asdict(self)
        for name in ("left_out", "estimates"):
            figures[name] = [one.as_dict() for one in getattr(self, name)]
        figures["audit"] = None if self.audit is None else self.audit.as_dict()
        return figures

    def __str__(self) -> str:
        """A line for each finding."""
        first = ("effects", f"{self.effects}, {counted(self.scenes, 'scene')}")
        return "\n".join(f"{name:10s} {text}" for name, text in [first, *self.rows()])

    def __repr__(self) -> str:
        return in_brief(self, self.effects, *(f"{name} {text}" for name, text in self.rows()))


def onset(effect: str, times: Any) -> Onset:
    """Onset of an effect from the times when it first acted, infinite where it never did [s]."""
    acted = [float(time) for time in times if math.isfinite(time)]
    return Onset(effect, len(acted), min(acted) if acted else None)
