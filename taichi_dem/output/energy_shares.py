"""Where the work went: terms of the energy balance as shares of what was given."""

from collections.abc import Mapping

import numpy as np

from taichi_dem.kit.data_table import Table
from taichi_dem.report.energy_balance import TERMS

_GIVEN = ("load_work", "support_work", "injected")
#: Of these some may be there at the start.
_HELD = ("kinetic", "bond_strain", "sphere_strain")


def energy_shares(history: Mapping[str, np.ndarray]) -> Table:
    """Share of every term of the energy balance over time.

    Parameters
    ----------
    history : mapping of str to ndarray
        Of a result.

    Returns
    -------
    Table
        ``time_s``; ``given_J``: work of loads and supports, energy injected at releases and held
        at the start; and a column ``NAME_share`` of each other term, ``residual_share`` of what is
        unexplained. Shares add up to 1 by the balance; where nothing is given they are NaN.
    """
    time_s = history["time_s"]
    held = sum(history[f"{name}_J"][:1].sum() for name in _HELD)
    given = sum((history[f"{name}_J"] for name in _GIVEN), np.full(len(time_s), held))
    safe = np.where(given > 0.0, given, np.nan)
    terms = [n for n in TERMS if n not in _GIVEN and f"{n}_J" in history]
    shares = {f"{name}_share": history[f"{name}_J"] / safe for name in terms}
    return Table({"time_s": time_s, "given_J": given, **shares}, index="time_s")
