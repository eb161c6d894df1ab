"""Peak particle velocities over the distance from a blast hole."""

from typing import Any, Optional

import numpy as np
from matplotlib.figure import Figure

from taichi_dem.kit.plot_style import BLACK, BLUE, GREY, picture
from taichi_dem.kit.validation import FileName


def plot_attenuation(path: Optional[FileName], attenuation: Any, nearest: float) -> Figure:
    """Peak speed of every body, and the power law fitted from the nearest distance on [radii].

    attenuation: an ``Attenuation``. Where too few bodies are nearer to the hole than to a side, as
    in a thin plate, all are fitted; where too few are far enough, no law is drawn.
    """
    distance, speed, inner = attenuation.distance, attenuation.speed, attenuation.inner
    slope, level = attenuation.power_law(nearest)
    fitted, words = inner, "fitted"
    if np.isnan(slope):
        slope, level = attenuation.power_law(nearest, inner_only=False)
        fitted, words = distance > 0.0, "fitted to all bodies"
    with picture(path, size=(6.6, 4.6)) as (figure, axes):
        for chosen, colour, side in ((~inner, GREY, "a free side"), (inner, BLUE, "the hole")):
            look = {"s": 4, "alpha": 0.4, "linewidths": 0, "color": colour}
            axes.scatter(distance[chosen], speed[chosen], label=f"bodies nearer to {side}", **look)
        if np.isfinite(slope):
            ends = np.array([nearest, distance[fitted].max()])
            fit, wave = level * ends**slope, (ends / ends[0]) ** -0.5
            label = f"power {slope:.2f} ({words})".replace("-", "−")
            axes.plot(ends, fit, color=BLACK, label=label)
            axes.plot(ends, fit[0] * wave, ":", color=BLACK, label="power −0.5 (cylindrical wave)")
        positive = speed[speed > 0.0]
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="distance from the axis / radius of the hole [1]",
            ylabel="peak particle velocity [m/s]",
            ylim=(0.5 * np.percentile(positive, 0.1), 2.0 * positive.max()),
        )
        for handle in axes.legend(loc="upper right", markerscale=4).legend_handles:
            handle.set_alpha(1.0)
    return figure
