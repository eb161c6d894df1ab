"""Sizes of fragments: the share of the mass that passes a sieve."""

from typing import Optional

import numpy as np
from matplotlib.figure import Figure

from taichi_dem.kit.plot_style import BLUE, GREY, picture
from taichi_dem.kit.validation import FileName
from taichi_dem.output.fragments import Fragments


def plot_fragments(path: Optional[FileName], fragments: Fragments) -> Figure:
    """Draw the share of all mass in fragments that pass a sieve, over its opening.

    Shaded: the sizes of single bodies, below which the mesh and not the material decides.
    """
    order = np.argsort(fragments["sieve_m"], kind="stable")
    size, mass = 1e3 * fragments["sieve_m"][order], fragments["mass_kg"][order]
    passing = 100.0 * np.cumsum(mass) / mass.sum()
    alone = 1e3 * fragments["sieve_m"][fragments["bodies"] == 1]
    with picture(path, size=(6.0, 4.0)) as (figure, axes):
        low, high = 0.7 * size[0], 1.4 * size[-1]
        across = np.concatenate([[low], size, [high]])
        axes.step(across, [passing[0], *passing, 100.0], where="post", color=BLUE)
        if len(alone):
            axes.axvspan(low, alone.max(), color=GREY, alpha=0.2, label="sizes of single bodies")
            axes.legend(loc="upper left")
        count = f"{len(size):,} fragment{'s' * (len(size) != 1)}"
        axes.set(xscale="log", xlim=(low, high), yscale="log", ylim=(0.7 * passing[0], 130.0))
        axes.set(xlabel="opening of the sieve [mm]", ylabel="share of the mass that passes [%]")
        axes.set_title(f"{count} at {1e3 * fragments.time_s:.3g} ms")
    return figure
