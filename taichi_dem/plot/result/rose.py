"""Rose of cracks: their area by direction."""

from typing import Optional

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from taichi_dem.kit.plot_style import BLUE, picture
from taichi_dem.kit.validation import FileName
from taichi_dem.output.cracks import Rose
from taichi_dem.plot.view import View


def plot_rose(path: Optional[FileName], rose: Rose) -> Figure:
    """Draw crack area by the direction of the cracks, which has no sense: both ends are shown."""
    angle, width = np.radians(rose["angle_deg"]), np.radians(rose.width_deg)
    view = View(rose.axis.tolist())
    with picture(path, size=(5.0, 4.6), subplot_kw={"projection": "polar"}) as (figure, axes):
        total = rose["area_m2"].sum() + rose.parallel_m2
        factor, unit = (1.0, "m²") if total > 0.1 else (1e4, "cm²")
        look = {"width": width, "color": BLUE, "edgecolor": "white", "linewidth": 0.5}
        for turn in (0.0, np.pi):
            axes.bar(angle + turn, factor * rose["area_m2"], **look)
        right, up = (label.replace(" [m]", "") for label in view.labels())
        if len(right) == len(up) == 1:
            axes.set_xticks(np.radians(np.arange(0, 360, 45)))
            axes.set_xticklabels([right, "45°", up, "135°", f"-{right}", "225°", f"-{up}", "315°"])
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.set_rlabel_position(_emptiest(rose))
        axes.tick_params(axis="y", labelsize=7.5)
        # The petals would hide the scale.
        axes.set_axisbelow(False)
        for label in axes.get_yticklabels():
            label.set_bbox({"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 0.5})
        words = f"Area of cracks by direction [{unit}], {factor * total:.4g} {unit} in all"
        axes.set_title(words, loc="center")
    return figure


def _emptiest(rose):
    """Direction around which there is the least crack area [degree]."""
    area = np.fft.rfft(rose["area_m2"])
    # Of the area over direction, its three slowest waves.
    smooth = np.fft.irfft(np.where(np.arange(len(area)) < 4, area, 0.0), len(rose["area_m2"]))
    return float(rose["angle_deg"][smooth.argmin()])
