"""Activity of effects in a run, and advice on those to leave out; plain data, no physics."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan
from typing import Any

from numpy import nan_to_num

from taichi_dem.kit.data_table import data_frame

#: Influence below which an effect may be worth a try without it.
SMALL = 0.01
#: Advice on such an effect.
TRY = "try without"
#: Columns of ``Advice.table`` with what stands in a row that has nothing to say there.
_COLUMNS = {
    **{"effect": "", "listed": False, "influence": nan, "events": 0, "since_s": nan, "where": ""},
    **{"energy_J": nan, "energy_share": nan, "evaluations": 0, "skipped": 0},
    **{"left_out": nan, "advice": "", "reason": ""},
}


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

    def negligible(self, tolerance: float) -> bool:
        """Whether it acted, but with less than a share of the energy, or only round-off.

        Parameters
        ----------
        tolerance : float
            Share of the energy.
        """
        if self.rounding:
            return not self.kept
        if self.share is None or self.steers or self.kept:
            return False
        return self.is_active and self.share < tolerance

    def __str__(self):
        """One line without the name."""
        if self.idle:
            return f"never acted (0 {self.what})"
        if self.rounding:
            return f"never acted beyond round-off (0 {self.what}, {self.energy_J:.3g} J)"
        energy = f", {self.energy_J:.3g} J" if self.energy_J is not None else ""
        share = f", {100 * self.share:.3g} % of {self.whole}" if self.share is not None else ""
        return f"{self.acted}{energy}{share}"

    @property
    def acted(self) -> str:
        """Its events in words, without the name and the energy."""
        most = f" of {self.of:,}" if self.of else ""
        return f"{self.events:,}{most} {self.what}"


@dataclass(frozen=True, repr=False)
class Advice:
    """Effects that a run needed, and those that it did not need.

    Parameters
    ----------
    uses : tuple of EffectUse
        Activity of each effect.
    missing : tuple
        Findings about effects that were left out, with how often and where.
    tolerance : float
        Share of the energy below which an effect counts as negligible.
    shown : mapping, optional
        Difference that a run without an effect made, by name, as a share of the record. Only
        effects whose difference is within the tolerance are then droppable. None if counts decide.
    left_out : tuple, default ()
        Estimates of effects that nothing serves; like the findings, each with a ``row``.
    """

    uses: tuple[EffectUse, ...]
    missing: tuple
    tolerance: float
    shown: Mapping[str, float] | None = None
    left_out: tuple = ()

    @property
    def inactive(self) -> tuple[str, ...]:
        """Names of the effects that never acted; without them no bit would differ."""
        return tuple(use.effect for use in self.uses if use.idle)

    @property
    def negligible(self) -> tuple[str, ...]:
        """Names of the effects with less energy than the tolerance, or only round-off."""
        return tuple(use.effect for use in self.uses if use.negligible(self.tolerance))

    @property
    def droppable(self) -> tuple[str, ...]:
        """Names of the effects that the scene could do without."""
        if self.shown is None:
            return self.inactive + self.negligible
        return tuple(name for name, found in self.shown.items() if found <= self.tolerance)

    @property
    def in_order(self) -> tuple[EffectUse, ...]:
        """Activity of each effect by its influence: not known first, then the largest."""

        def size(use):
            return nan_to_num(self._influence(use), nan=inf), use.events

        return tuple(sorted(self.uses, key=size, reverse=True))

    def _influence(self, use):
        """Difference of a run without an effect, else its own influence; NaN if not known."""
        own = nan if use.influence is None else use.influence
        return (self.shown or {}).get(use.effect, own)

    def _lost(self, use):
        """What an answer would lose without an effect, in words."""
        found = (self.shown or {}).get(use.effect)
        if found == 0.0:
            same = "the same up to rounding" if use.rounding else "the same"
            return f"; a run without it is {same}"
        if found is not None:
            differs = f"differs by {100.0 * found:.2g} %"
            return f"; a run without it {differs if found < inf else 'breaks elsewhere or fails'}"
        if self._advice(use) != TRY:
            return ""
        more = "" if use.idle or not use.steers else ", and may change more than its energy"
        return f"; no run without it was made{more}"

    def verdict(self, name: str, kind: str) -> tuple[str, str]:
        """What an effect did, and advice in words.

        Parameters
        ----------
        name : str
            Name of the effect in reports.
        kind : str
            Its class, by which findings about missing effects name it.

        Returns
        -------
        tuple of (str, str)
            What it did, and "keep it", "drop it", "list it" or "not missed".
        """
        for use in self.uses:
            if use.effect == name:
                return str(use), "drop it" if name in self.droppable else "keep it"
        for finding in self.missing:
            if finding.effect == kind:
                return f"{finding.what}: {finding.count}", "list it"
        return "left out", "not missed"

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
        rows = [self._row(use) for use in self.in_order]
        rows += [finding.row for finding in (*self.missing, *self.left_out)]
        known = [{n: value for n, value in row.items() if value is not None} for row in rows]
        return data_frame({n: [row.get(n, e) for row in known] for n, e in _COLUMNS.items()})

    def _row(self, use) -> dict[str, Any]:
        return {
            **{"effect": use.effect, "listed": True, "influence": self._influence(use)},
            **{"events": use.events, "since_s": use.since_s},
            **{"where": use.where, "energy_J": use.energy_J, "energy_share": use.share},
            **{"evaluations": use.evaluations, "skipped": use.skipped},
            **{"advice": self._advice(use), "reason": f"{use}{self._reason(use)}"},
        }

    def _advice(self, use):
        if use.effect in self.droppable:
            return "drop"
        untried = use.effect not in (self.shown or {})
        return TRY if untried and use.minor(max(SMALL, self.tolerance)) else "keep"

    def _reason(self, use):
        return f"; {use.kept}" if use.kept else self._lost(use)

    def __str__(self):
        """A line for every effect in order, then one for every missing effect."""
        lines = [
            f"{self._advice(use):11s} {use.effect:16s} {use}{self._reason(use)}"
            for use in self.in_order
        ]
        return "\n".join([*lines, *(f"{'missed':11s} {finding}" for finding in self.missing)])

    __repr__ = __str__
