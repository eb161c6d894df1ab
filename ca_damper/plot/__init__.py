"""Pictures of the damper; the only part of the package that imports matplotlib."""

from ca_damper.plot.animation import animate_patterns
from ca_damper.plot.box import Box
from ca_damper.plot.motion import animate_motion, plot_motion
from ca_damper.plot.patterns import plot_cycle, plot_patterns
from ca_damper.plot.rebound import plot_rebound

__all__ = [
    "Box",
    "animate_motion",
    "animate_patterns",
    "plot_cycle",
    "plot_motion",
    "plot_patterns",
    "plot_rebound",
]
