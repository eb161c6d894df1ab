"""Shares of the energy given that each term of the balance has, stacked over time."""

from collections.abc import Mapping
from typing import Optional

import numpy as np
from matplotlib.figure import Figure

from taichi_dem.kit.plot_style import picture
from taichi_dem.kit.validation import FileName
from taichi_dem.plot.series import ENERGY_TERMS
from taichi_dem.plot.summary import scale


def plot_energy_shares(path: Optional[FileName], shares: Mapping[str, np.ndarray]) -> Figure:
    """Stack the shares of ``output.energy_shares``; what is missing to 100 % is unexplained."""
    factor, unit = scale(float(shares["time_s"].max(initial=0.0)), "s")
    looks = {key.replace("_J", "_share"): look for key, look in ENERGY_TERMS.items()}
    terms = {name: look for name, look in looks.items() if name in shares and shares[name].any()}
    given = np.isfinite(shares["given_J"]) & (shares["given_J"] > 0.0)
    with picture(path, size=(6.8, 3.6)) as (figure, axes):
        values = [100.0 * shares[name][given] for name in terms]
        labels, colours = ([look[k] for look in terms.values()] for k in (0, 1))
        look = {"colors": colours, "labels": labels, "edgecolor": "white", "linewidth": 0.3}
        if terms:
            axes.stackplot(factor * shares["time_s"][given], values, **look)
        axes.set(xlabel=f"time [{unit}]", ylabel="share of the energy given [%]")
        axes.set(ylim=(0.0, 100.0))
        axes.margins(x=0.0)
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles[::-1], labels[::-1], loc="outside right upper")
    return figure
