"""Pictures of a run; the only part of the package that imports matplotlib."""

from taichi_dem.plot.acting import plot_acting
from taichi_dem.plot.animation import save_animation
from taichi_dem.plot.attenuation import plot_attenuation
from taichi_dem.plot.block import plot_cracks, plot_steps
from taichi_dem.plot.deep import plot_deep_cracks
from taichi_dem.plot.probability import plot_crack_probability
from taichi_dem.plot.series import (
    plot_energy,
    plot_history,
    plot_levels,
    plot_methods,
    plot_pressure,
)

__all__ = [
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
