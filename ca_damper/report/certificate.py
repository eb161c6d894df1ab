"""Certificate of a run: when effects first acted, what was left out, what is periodic."""

from dataclasses import asdict, dataclass
from typing import Any

from taichi_dem.kit.display import counted
from taichi_dem.kit.effect_table import BaseCertificate, Estimate

#: Words for which effects of a filling are computed: those that its options list, or those that an
#: estimate before the run calls for.
EFFECTS = ("listed", "auto")


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


@dataclass(frozen=True, kw_only=True, repr=False)
class Certificate(BaseCertificate):
    """Effects computed and left out in a run, with estimates.

    Parameters
    ----------
    acting : tuple of EffectUse, default ()
        For each effect that was computed, in how many scenes it acted and from when, as far as the
        filling counts it.
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
    skipped_tests : int, default 0
        Contact tests that were not needed, as no contact could come up before the next.
    """

    effects: str
    estimates: tuple[Estimate, ...] = ()
    periods: Periods | None = None
    skipped_tests: int = 0

    def left_out_lines(self) -> list[str]:
        """What was left out, and what is periodic, in lines."""
        lines = [f"estimated: {estimate}" for estimate in self.estimates]
        skipped = [f"contact tests: {self.skipped_tests:,} skipped"] if self.skipped_tests else []
        periodic = [f"periodic: {self.periods}"] if self.periods is not None else []
        return [*lines, *super().left_out_lines(), *skipped, *periodic]

    def as_dict(self) -> dict[str, Any]:
        """All figures, for a JSON file.

        Returns
        -------
        dict
            Figures by name.
        """
        return {
            "effects": self.effects,
            **super().as_dict(),
            "estimates": [one.as_dict() for one in self.estimates],
            "periods": self.periods and asdict(self.periods),
            "skipped_tests": self.skipped_tests,
        }
