"""Audit of skipped evaluations: some are made all the same, and say how many may have been missed.

A few of all evaluations that were skipped, chosen by a counter and not by their result, are made
and compared. What was found among them bounds the share of misses among all of them.
"""

from dataclasses import asdict, dataclass
from typing import Any

#: Confidence of the bound.
CONFIDENCE = 0.95


def misses_bound(misses: int, audited: int) -> float:
    """Upper bound, with a confidence of 95 %, of the share of misses among what was skipped.

    Exact for a binomial number of misses (Clopper and Pearson, Biometrika 26, 1934): the share at
    which so few misses or fewer have a chance of 5 %. About 3 / audited without a miss, and 1 where
    nothing was audited.
    """
    if misses == audited:
        return 1.0
    from scipy.special import betaincinv

    # A tail of the binomial is an incomplete beta.
    return float(betaincinv(misses + 1.0, audited - misses, CONFIDENCE))


@dataclass(frozen=True)
class Audit:
    """Outcome of an audit.

    Parameters
    ----------
    skipped : int
        Evaluations that were not needed, those made for the audit among them.
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
        """Upper bound of the share of misses, with a confidence of 95 %."""
        return misses_bound(self.misses, self.audited)

    @property
    def failure(self) -> str:
        """What it found missed, in words; ``""`` where nothing was."""
        if not self.misses:
            return ""
        misses = f"{self.misses:,} miss{'' if self.misses == 1 else 'es'}"
        return f"an audit of {self.audited:,} skipped {self.what} found {misses}"

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        return {**asdict(self), "misses_bound": self.misses_bound}

    def __str__(self) -> str:
        counts = f"{self.audited:,} of {self.skipped:,} skipped {self.what}"
        if not self.audited:
            return f"{counts}, nothing is known of the others"
        misses = f"{self.misses:,} miss{'' if self.misses == 1 else 'es'}"
        return f"{counts}, {misses} (< {100.0 * self.misses_bound:.2g} %)"
