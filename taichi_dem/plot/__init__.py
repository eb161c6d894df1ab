"""Pictures of a run; the only part of the package that imports matplotlib."""

from taichi_dem.plot.block import plot_acting, plot_cracks, plot_film, plot_steps
from taichi_dem.plot.series import plot_energy
from taichi_dem.plot.tables import (
    plot_attenuation,
    plot_block,
    plot_fragments,
    plot_history,
    plot_rose,
)

__all__ = [
    "plot_acting",
    "plot_attenuation",
    "plot_block",
    "plot_cracks",
    "plot_energy",
    "plot_film",
    "plot_fragments",
    "plot_history",
    "plot_rose",
    "plot_steps",
]
