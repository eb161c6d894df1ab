"""One table of the effects of a run, and two views of it: advice on them, and a certificate."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from numpy import nan_to_num

from taichi_dem.kit.data_table import data_frame
from taichi_dem.kit.display import Worded

NEGLIGIBLE, NEEDED, UNCLEAR = "negligible", "needed", "unclear"
#: Grades of a certificate.
HOLDS, HOLDS_BUT, FAILS = "holds", "holds but for", "does not hold"
#: Groups below which an effect is negligible, and from which on it is needed.
LIMITS = (0.05, 2.0)
#: Influence below which an effect may be worth a try without it.
SMALL = 0.01
#: Advice on such an effect.
TRY = "try without"
#: Columns of the table with what stands in a row that has nothing to say there.
_COLUMNS = {
    **{"effect": "", "listed": False, "influence": math.nan, "events": 0, "since_s": math.nan},
    **{"where": "", "energy_J": math.nan, "energy_share": math.nan, "evaluations": 0},
    **{"skipped": 0, "left_out": math.nan, "advice": "", "reason": ""},
}


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
        row = {"effect": self.effect, "left_out": self.group}
        return {**row, "advice": self.verdict, "reason": self.words}

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file; a group that is not known is None."""
        group = None if math.isnan(self.group) else self.group
        said = {"words": self.words, "verdict": self.verdict}
        return {"effect": self.effect, "group": group, **said}

    def __str__(self):
        value = "not known" if math.isnan(self.group) else f"{self.group:.2g}"
        return f"{self.effect}: {self.verdict} ({self.words} {value})"


@dataclass(frozen=True)
class EffectUse:
    """Activity of one effect.

    Parameters
    ----------
    effect : str
        Name of the effect.
    what : str
        Its events in words.
    events : int
        Number of events.
    of : int, default 0
        Largest possible number of events; 0 for no limit.
    energy_J : float, optional
        Energy taken or given [J]; None where it is not booked.
    share : float, optional
        Size as a share of ``whole``; None where there is nothing to compare with.
    whole : str, default "the energy put in"
        What the share is of, in words.
    steers : bool, default False
        Whether it directs the motion even if it takes little energy, as a crack does; such an
        effect can be left out only if it never acted.
    kept : str, default ""
        Reason to keep it in any case, in words, or ``""``.
    rounding : bool, default False
        Whether the booked energy is within rounding errors; then no event is counted.
    since_s : float, optional
        Time of the first event [s]; None where it is not known.
    where : str, default ""
        Place of the first event, such as ``"body 3"``; ``""`` where it is not known.
    evaluations : int, default 0
        Evaluations made, where they are counted.
    skipped : int, default 0
        Evaluations that were not needed.
    """

    effect: str
    what: str
    events: int
    of: int = 0
    energy_J: float | None = None
    share: float | None = None
    whole: str = "the energy put in"
    steers: bool = False
    kept: str = ""
    rounding: bool = False
    since_s: float | None = None
    where: str = ""
    evaluations: int = 0
    skipped: int = 0

    @property
    def is_active(self) -> bool:
        """Whether any event was counted."""
        return self.events > 0

    @property
    def idle(self) -> bool:
        """Whether it is known that it did not change the run, not even its rounding."""
        return not (self.is_active or self.kept or self.rounding)

    @property
    def influence(self) -> float | None:
        """Its share, 0 where it never acted beyond round-off; None where no energy tells it."""
        if self.idle or self.rounding:
            return 0.0
        return None if self.kept and self.steers else self.share

    def minor(self, most: float) -> bool:
        """Whether it may be left out for a try: its influence is at most a share."""
        return not self.kept and self.influence is not None and self.influence <= most

    def __str__(self):
        """One line without the name."""
        energy = f", {self.energy_J:.3g} J" if self.energy_J is not None else ""
        share = f", {100 * self.share:.3g} % of {self.whole}" if self.share is not None else ""
        return f"{self.acted}{energy}{', which is round-off' if self.rounding else share}"

    @property
    def acted(self) -> str:
        """Its events and their begin in words, without the name and the energy."""
        most = f" of {self.of:,}" if self.of else ""
        begun = f" from {1e3 * self.since_s:.3g} ms" if self.since_s is not None else ""
        return f"{self.events:,}{most} {self.what}{begun}"


@dataclass(frozen=True, kw_only=True, repr=False)
class EffectTable(Worded):
    """Effects that a run needed, those that it did not need, and those that it lacked.

    Parameters
    ----------
    acting : tuple of EffectUse
        Activity of each listed effect: what it did, where and since when.
    missing : tuple, default ()
        Findings about effects that were left out, with how often and where.
    left_out : tuple of Estimate, default ()
        Estimates of effects that nothing serves; like the findings, each with a ``row``.
    warnings : tuple of str, default ()
        Sentences of the report about the run, all but those about missing effects.
    tolerance : float, default 0.0
        Share of the energy below which an effect counts as negligible.
    shown : mapping, optional
        Difference that a run without an effect made, by name, as a share of the record. Only
        effects whose difference is within the tolerance are then droppable. None if counts decide.
    """

    acting: tuple[EffectUse, ...] = ()
    missing: tuple = ()
    left_out: tuple[Estimate, ...] = ()
    warnings: tuple[str, ...] = ()
    tolerance: float = 0.0
    shown: Mapping[str, float] | None = field(default_factory=dict)

    def advised(
        self, tolerance: float, shown: Mapping[str, float] | None = None, found: Iterable[Any] = ()
    ) -> "EffectTable":
        """The table as advice; shown: by runs without some effects, found: more that is missing."""
        missing = *self.missing, *found
        table = EffectTable(acting=self.acting, missing=missing, left_out=self.left_out)
        return replace(table, tolerance=tolerance, shown=shown)

    @property
    def inactive(self) -> tuple[str, ...]:
        """Names of the effects that never acted; without them no bit would differ."""
        return tuple(use.effect for use in self.acting if use.idle)

    @property
    def droppable(self) -> tuple[str, ...]:
        """Names of the effects that the scene could do without."""
        if self.shown is not None:
            return tuple(name for name, change in self.shown.items() if change <= self.tolerance)
        acted = (use for use in self.acting if not use.idle and use.minor(self.tolerance))
        return *self.inactive, *(use.effect for use in acted if use.rounding or not use.steers)

    @property
    def in_order(self) -> tuple[EffectUse, ...]:
        """Activity of each effect by its influence: not known first, then the largest."""

        def size(use):
            return nan_to_num(self._influence(use), nan=math.inf), use.events

        return tuple(sorted(self.acting, key=size, reverse=True))

    def _influence(self, use):
        """Difference of a run without an effect, else its own influence; NaN if not known."""
        own = math.nan if use.influence is None else use.influence
        return (self.shown or {}).get(use.effect, own)

    @property
    def faults(self) -> tuple[str, ...]:
        """What is known to be wrong or missed, in words."""
        return tuple(effect.what for effect in self.missing)

    @property
    def holds(self) -> bool:
        """Whether nothing is known to be wrong or missed; ``but_for`` names what is not clear."""
        return not self.faults

    @property
    def but_for(self) -> tuple[str, ...]:
        """What may have been left out that is not negligible, and what the report warns of."""
        unclear = (estimate for estimate in self.left_out if estimate.verdict != NEGLIGIBLE)
        findings = (sentence.partition(": ")[0] for sentence in self.warnings)
        return *(f"{estimate.effect} ({estimate.verdict})" for estimate in unclear), *findings

    @property
    def grade(self) -> str:
        """``"holds"``, ``"holds but for"`` (see ``but_for``) or ``"does not hold"``."""
        return (HOLDS_BUT if self.but_for else HOLDS) if self.holds else FAILS

    @property
    def failure(self) -> str:
        """Why the certificate does not hold, and a remedy; ``""`` where it holds."""
        lacked = ", ".join(effect.effect for effect in self.missing)
        remedy = f"list {lacked}" if lacked else "run the scene with effects='all'"
        return "" if self.holds else f"{', and '.join(self.faults)}: {remedy}"

    @property
    def verdict(self) -> str:
        """Whether it holds, in words."""
        words = "; ".join(self.but_for) if self.holds else f"as {self.failure}"
        return f"{self.grade}{'' if self.holds else ','} {words}".strip()

    def table(self) -> Any:
        """Give all that is known of the effects, a row for each.

        Returns
        -------
        pandas.DataFrame
            Name, whether listed, number and first time and place of its events, energy [J] and its
            share, evaluations made and skipped, estimated size of what was left out, as a share of
            what it acts beside; advice and its reason. ``influence``: what an answer would lose
            without the effect, the difference of a run without it where one was made, else its
            share of the energy; NaN where neither tells. Rows are in its order, the largest first.
        """
        rows = [*self._rows(), *(entry.row for entry in (*self.missing, *self.left_out))]
        known = [{n: value for n, value in row.items() if value is not None} for row in rows]
        return data_frame({n: [row.get(n, e) for row in known] for n, e in _COLUMNS.items()})

    def _rows(self) -> Iterator[dict[str, Any]]:
        """A row of each listed effect, in order."""
        for use in self.in_order:
            advice, why = self._advice(use)
            row = {"listed": True, "influence": self._influence(use), "energy_share": use.share}
            yield {**vars(use), **row, "advice": advice, "reason": f"{use}{why}"}

    def _advice(self, use):
        """What to do about an effect, and why, or what an answer would lose without it."""
        change = (self.shown or {}).get(use.effect)
        advice = "drop" if use.effect in self.droppable else "keep"
        if use.kept:
            return advice, f"; {use.kept}"
        if change is not None:
            differs = f"differs by {100.0 * change:.2g} %"
            fails = "breaks elsewhere or fails"
            return advice, f"; a run without it {differs if change < math.inf else fails}"
        if advice == "drop" or not use.minor(max(SMALL, self.tolerance)):
            return advice, ""
        more = "" if use.idle or not use.steers else ", and may change more than its energy"
        return TRY, f"; no run without it was made{more}"

    def __str__(self):
        """A line for every effect in order, then one for every missing effect."""
        lines = [f"{row['advice']:11s} {row['effect']:16s} {row['reason']}" for row in self._rows()]
        return "\n".join([*lines, *(f"{'missed':11s} {finding}" for finding in self.missing)])

    def __repr__(self):
        return str(self)


class BaseCertificate(EffectTable):
    """The table as a certificate, which says when effects acted and what was left out."""

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        return {
            "acting_since_s": {use.effect: use.since_s for use in self.acting},
            "holds": self.holds,
            "grade": self.grade,
            "but_for": list(self.but_for),
            "left_out": [estimate.as_dict() for estimate in self.left_out],
        }

    def left_out_lines(self) -> list[str]:
        """What was left out, in lines."""
        lines = [f"left out: {estimate}" for estimate in self.left_out]
        return [*lines, *([] if self.grade == HOLDS else [f"this certificate {self.verdict}"])]

    def __str__(self):
        """A line for each effect, what it did and since when; then what was left out."""
        acted = (f"{use.effect}: {use.acted}" for use in self.acting)
        return "\n".join([*acted, *self.left_out_lines()])
