"""Pictures of a run; the only part of the package that imports matplotlib."""

from taichi_dem.plot.block import plot_acting, plot_cracks, plot_steps
from taichi_dem.plot.film import save_animation
from taichi_dem.plot.result.pictures import plot_attenuation
from taichi_dem.plot.series import (
    plot_energy,
    plot_history,
    plot_levels,
    plot_pressure,
)

__all__ = [
    "plot_acting",
    "plot_attenuation",
    "plot_cracks",
    "plot_energy",
    "plot_history",
    "plot_levels",
    "plot_pressure",
    "plot_steps",
    "save_animation",
]
