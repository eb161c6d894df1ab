"""Pictures of the damper; the only part of the package that imports matplotlib."""

from ca_damper.plot.box import Box
from ca_damper.plot.rebound import plot_rebound

__all__ = ["Box", "plot_rebound"]
