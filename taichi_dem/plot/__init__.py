"""Pictures of a run; the only part of the package that imports matplotlib."""

from taichi_dem.plot.block import plot_acting, plot_cracks, plot_steps
from taichi_dem.plot.deep import plot_crack_probability, plot_deep_cracks
from taichi_dem.plot.film import film_runs, save_animation
from taichi_dem.plot.result.pictures import plot_attenuation
from taichi_dem.plot.series import (
    plot_energy,
    plot_history,
    plot_levels,
    plot_methods,
    plot_pressure,
)

__all__ = [
    "film_runs",
    "plot_acting",
    "plot_attenuation",
    "plot_crack_probability",
    "plot_cracks",
    "plot_deep_cracks",
    "plot_energy",
    "plot_history",
    "plot_levels",
    "plot_methods",
    "plot_pressure",
    "plot_steps",
    "save_animation",
]
