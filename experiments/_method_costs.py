"""What methods cost over the time of a run, and how far apart their answers lie."""

import numpy as np

from taichi_dem import Collector, Every
from taichi_dem.kit.plot_style import picture, styles_of

#: Displacements that methods may be compared by, and how they are called.
_COMPARED = {"hole_radial_displacement_mm": "hole", "monitor_displacement_mm": "body watched"}


class RunCosts(Collector):
    """Observer that keeps what a run has cost at every sample, and the levels of its bodies.

    view: of the last sample.
    """

    def __init__(self):
        super().__init__(
            Every(samples=1),
            cpu_s=lambda view: view.cpu_seconds,
            evaluations=lambda view: view.evaluations,
            level=lambda view: view.motion()["level"],
        )

    @property
    def columns(self):
        """CPU seconds and evaluations so far, of each sample."""
        return {name: self.rows[name] for name in ("cpu_s", "evaluations")}

    @property
    def levels(self):
        """Levels of the bodies of each sample, (body_count,) each."""
        return self.rows["level"]


def plot_methods(path, series, column):
    """What methods cost over time, and how far their displacement lies apart.

    series: method -> columns time_s, cpu_s, evaluations and the one compared, of ``_COMPARED``; the
    first is the one the others are compared with.
    """
    with picture(path, 2, 2, size=(9.0, 6.4)) as (_, ((cost, work), (moved, words))):
        first = next(iter(series.values()))
        styles = styles_of(series)
        for name, made in series.items():
            style = styles[name]
            look = {"color": style.colour, "linestyle": style.line, "label": style.label}
            time = 1e3 * np.asarray(made["time_s"])
            cost.plot(time, made["cpu_s"], **look)
            work.plot(time, 1e-6 * np.asarray(made["evaluations"]), **look)
            here = np.asarray(made[column])
            # Largest steps differ, and with them the times of the samples.
            there = np.interp(time, 1e3 * first["time_s"], first[column])
            there = np.where(there > 1e-3 * there.max(), there, np.nan)
            moved.plot(time, 100.0 * (here / there - 1.0), **look)
        cost.set(ylabel="CPU time of stepping [s]")
        work.set(ylabel="evaluations of bonds\nand contact pairs [10⁶]")
        for axes, name, unit in ((cost, "cpu_s", 1.0), (work, "evaluations", 1e6)):
            last = [made[name][-1] / unit for made in series.values()]
            # A run begins with nothing done, where a logarithm has no end.
            log = max(last) > 20.0 * min(last)
            axes.set_yscale("log" if log else "linear")
            axes.set_ylim(0.01 * min(last) if log else 0.0, None)
        base = next(iter(styles.values())).label
        moved.set(ylabel=f"displacement of the {_COMPARED[column]},\ndifference from\n{base} [%]")
        for axes in (cost, work, moved):
            axes.set(xlabel="time [ms]", xlim=(0.0, time[-1] or 1.0))
        words.set_axis_off()
        words.legend(*moved.get_legend_handles_labels(), loc="center left", handlelength=4.0)
