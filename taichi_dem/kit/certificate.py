"""Parts of a certificate of a run: estimates of what was left out, and audits.

Audits recompute some skipped evaluations, chosen by a counter and not by their result.
"""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from taichi_dem.kit.effect_usage import EffectUse

NEGLIGIBLE, NEEDED, UNCLEAR = "negligible", "needed", "unclear"
#: Grades of a certificate.
HOLDS, HOLDS_BUT, FAILS = "holds", "holds but for", "does not hold"
#: Groups below which an effect is negligible, and from which on it is needed.
LIMITS = (0.05, 2.0)
#: Confidence of the bound of misses.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Estimate:
    """Dimensionless group by which an effect is judged.

    Parameters
    ----------
    effect : str
        Name of the effect.
    group : float
        Value of the group [-]; NaN where it is not known.
    words : str
        The group in words.
    limits : tuple of (float, float), default LIMITS
        Group below which the effect is negligible, and group from which it is needed.
    """

    effect: str
    group: float
    words: str
    limits: tuple[float, float] = LIMITS

    @property
    def verdict(self) -> str:
        """``"negligible"``, ``"needed"`` or ``"unclear"``."""
        low, high = self.limits
        return NEGLIGIBLE if self.group < low else NEEDED if self.group >= high else UNCLEAR

    @property
    def row(self) -> dict[str, Any]:
        """What it adds to the table of effects."""
        said = {"advice": self.verdict, "reason": self.words}
        return {"effect": self.effect, "left_out": self.group, **said}

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file; a group that is not known is None."""
        group = None if math.isnan(self.group) else self.group
        said = {"words": self.words, "verdict": self.verdict}
        return {"effect": self.effect, "group": group, **said}

    def __str__(self):
        value = "not known" if math.isnan(self.group) else f"{self.group:.2g}"
        return f"{self.effect}: {self.verdict} ({self.words} {value})"


@dataclass(frozen=True)
class Audit:
    """Outcome of an audit.

    Parameters
    ----------
    skipped : int
        Evaluations that were not needed, including those of the audit.
    audited : int
        Skipped evaluations that were made and compared.
    misses : int
        Audited evaluations that would have changed something.
    what : str, default "evaluations"
        The evaluations in words.
    """

    skipped: int
    audited: int
    misses: int
    what: str = "evaluations"

    @property
    def misses_bound(self) -> float:
        """Upper bound of the share of misses among what was skipped, confidence 95 %.

        Clopper and Pearson, Biometrika 26, 1934: about 3 / audited without a miss.
        """
        if self.misses == self.audited:
            return 1.0
        if not self.misses:
            # In closed form, as nearly always: SciPy takes 0.3 s to import.
            return -math.expm1(math.log(1.0 - CONFIDENCE) / self.audited)
        from scipy.special import betaincinv

        # A tail of the binomial is an incomplete beta.
        return float(betaincinv(self.misses + 1.0, self.audited - self.misses, CONFIDENCE))

    @property
    def failure(self) -> str:
        """What it found missed, in words; ``""`` where nothing was."""
        if not self.misses:
            return ""
        return f"an audit of {self.audited:,} skipped {self.what} found {self._misses()}"

    def _misses(self):
        return f"{self.misses:,} miss{'' if self.misses == 1 else 'es'}"

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file."""
        return {**asdict(self), "misses_bound": self.misses_bound}

    def __str__(self) -> str:
        counts = f"{self.audited:,} of {self.skipped:,} skipped {self.what}"
        if not self.audited:
            return f"{counts}, nothing is known of the others"
        return f"{counts}, {self._misses()} (< {100.0 * self.misses_bound:.2g} %)"


@dataclass(frozen=True, kw_only=True, repr=False)
class BaseCertificate:
    """What the certificates of both packages have in common."""

    acting: tuple[EffectUse, ...] = ()
    audits: tuple[Audit, ...] = ()
    left_out: tuple[Estimate, ...] = ()
    warnings: tuple[str, ...] = ()

    def _faults(self) -> list[str]:
        return [audit.failure for audit in self.audits if audit.misses]

    @property
    def holds(self) -> bool:
        """Whether nothing is known to be wrong or missed; ``but_for`` names what is not clear."""
        return not self.failure

    @property
    def but_for(self) -> tuple[str, ...]:
        """What may have been left out that is not negligible, and what the report warns of."""
        unclear = (one for one in self.left_out if one.verdict != NEGLIGIBLE)
        findings = (sentence.partition(": ")[0] for sentence in self.warnings)
        return *(f"{one.effect} ({one.verdict})" for one in unclear), *findings

    @property
    def grade(self) -> str:
        """``"holds"``, ``"holds but for"`` (see ``but_for``) or ``"does not hold"``."""
        if not self.holds:
            return FAILS
        return HOLDS_BUT if self.but_for else HOLDS

    @property
    def failure(self) -> str:
        """Why the certificate does not hold, and a remedy; ``""`` where it holds."""
        faults = self._faults()
        return f"{', and '.join(faults)}: {self.remedy}" if faults else ""

    @property
    def verdict(self) -> str:
        """Whether it holds, in words."""
        if not self.holds:
            return f"{FAILS}, as {self.failure}"
        return f"{self.grade} {'; '.join(self.but_for)}".strip()

    @property
    def remedy(self) -> str:
        """Remedy of a fault."""
        raise NotImplementedError

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file."""
        return {
            "acting_since_s": {use.effect: use.since_s for use in self.acting},
            "holds": self.holds,
            "grade": self.grade,
            "but_for": list(self.but_for),
            "audits": [audit.as_dict() for audit in self.audits],
            "left_out": [estimate.as_dict() for estimate in self.left_out],
        }

    def acted(self) -> Iterator[str]:
        """A line for each effect: what it did, and since when."""
        for use in self.acting:
            begun = f" from {1e3 * use.since_s:.3g} ms" if use.since_s is not None else ""
            yield f"{use.effect}: {'never' if use.idle else use.acted + begun}"

    def left_out_lines(self) -> list[str]:
        """What was left out, in lines."""
        lines = [f"left out: {estimate}" for estimate in self.left_out]
        lines += [f"audit: {audit}" for audit in self.audits if audit.skipped]
        lines += [] if self.grade == HOLDS else [f"this certificate {self.verdict}"]
        return lines

    def __str__(self):
        """A line for every kind of thing."""
        return "\n".join([*self.acted(), *self.left_out_lines()])

    __repr__ = __str__
