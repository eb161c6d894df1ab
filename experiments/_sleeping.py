"""Table and picture of ``demo_sleeping.py``."""

from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, GREY, ORANGE, picture

#: Columns of runs in the table, by name.
RUNS = ("asleep", "awake")


def write(folder, slept, whole):
    """Write a row a look of both runs."""
    rows = [{"run": name, **row} for name, run in zip(RUNS, (slept, whole)) for row in run]
    study.write_rows(folder / "sleeping.csv", rows)


def draw(path, slept, whole, length):
    """How far the wave and the zone awake reach, and what both runs cost; length: in m."""
    times, others = ([1e3 * row["time_s"] for row in run] for run in (slept, whole))
    with picture(path, 1, 2, (9.0, 3.6)) as (_, (left, right)):
        left.plot(times, [row["awake_m"] for row in slept], color=BLUE, label="last body awake")
        left.plot(times, [row["front_m"] for row in slept], color=ORANGE, label="1 % of the speed")
        left.axhline(length, color=GREY, linestyle="--", label="end of the pile")
        left.set(xlabel="time [ms]", ylabel="distance from the head [m]", ylim=(0.0, 1.08 * length))
        left.legend(loc="center left")
        look = {"color": GREY, "linestyle": "-.", "label": "all evaluated"}
        right.plot(others, [row["cpu_s"] for row in whole], **look)
        right.plot(times, [row["cpu_s"] for row in slept], color=BLUE, label="asleep until reached")
        right.set(xlabel="time [ms]", ylabel="CPU time of stepping [s]", ylim=(0.0, None))
        right.legend(loc="upper left")


def caption(figures):
    """What the picture shows, in words."""
    share, gain, error = (
        figures[key][0] for key in ("asleep_percent", "speedup_by_sleep", "error_by_sleep_percent")
    )
    return (
        f"A blow on the head of a pile. Bodies sleep until a neighbour moves by more than a share "
        f"of the mean speed, or of a bond's limit: {share:.0f} % of all bodies times time asleep, "
        f"steps {gain:.1f} times cheaper in all, and displacements that differ by {error:.1g} % of "
        f"the largest."
    )
