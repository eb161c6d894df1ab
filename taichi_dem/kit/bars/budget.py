"""The error budget of an answer: each source of error, measured or not, and its price."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from taichi_dem.kit.validation import choice, several

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Source:
    """One source of error of an answer; the bar includes the measured ones.

    Parameters
    ----------
    name : str
        Name.
    error : float or ndarray
        Half-width of its part of the bar, in the unit of the value; nan where it was not measured.
    how : str
        How it was measured, or what would measure it.
    seconds : float, default nan
        CPU time that its measurement took or would take [s]; nan if unknown.
    common : float, default 0.0
        If not measured, the half-width that half of such questions exceed; 0 if unknown.
    """

    name: str
    error: Any
    how: str
    seconds: float = math.nan
    common: float = 0.0

    @property
    def measured(self) -> bool:
        """Whether the bar has it."""
        return not np.isnan(self.error).any()

    def in_words(self, unit: str) -> str:
        """A line: name, half-width or nothing, how, and the price."""
        largest = float(np.abs(self.error).max(initial=0.0)) if self.measured else math.nan
        bar = f"+-{largest:.2g}{f' {unit}' if unit != '1' else ''}" if self.measured else "?"
        price = f", {self.seconds:.2g} s" if self.seconds > 0.0 else ""
        return f"  {self.name:9} {bar:14} {self.how}{price}"


def named_sources(given: Any, known: Sequence[str]) -> tuple[str, ...]:
    """Names of sources to measure, in the order of the known ones; the first is always measured."""
    names = several("sources", given, lambda name, source: choice(name, source, known))
    return tuple(name for name in known if name in (known[0], *names))


def table(sources: Sequence[Source]) -> "pd.DataFrame":
    """Sources as rows: error, whether the bar has it, how, and CPU seconds, by name."""
    # Imported here: most answers are printed only, and pandas takes half a second.
    import pandas as pd

    columns = {
        "error": [source.error for source in sources],
        "in_bar": [source.measured for source in sources],
        "how": [source.how for source in sources],
        "cpu_s": [source.seconds for source in sources],
    }
    return pd.DataFrame(columns, index=pd.Index([source.name for source in sources], name="source"))
