"""Figures and picture of the checks of the tunnel: lobes of a charge, peak velocities of shots."""

import numpy as np

from _radiation import BINS, ELEMENTS
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, RED, picture

#: Number of elements in a wave of shear that is asked, among ``ELEMENTS``.
ASKED = ELEMENTS.index(8.0)
#: Directions [degrees].
MIDDLES = 0.5 * (BINS[1:] + BINS[:-1])
#: Receivers behind a hole [m]; burden of the damaged rock, and its reach around the hole [m].
BEHIND, DAMAGED, REACH = (0.3, 0.5, 0.8, 1.2, 1.7), 0.4, 0.6


def half_range(values):
    """Half of the range over the meshes, the first axis."""
    return 0.5 * np.ptp(values, axis=0)


def scaled(made, wave, k, ours="ours", theory="far"):
    """Ours and theory by direction, each by its own peak, (meshes, 9) each."""
    both = (np.array([one[name][wave][k] for one in made]) for name in (ours, theory))
    return tuple(one / one.max(axis=1, keepdims=True) for one in both)


def largest_error(made, *given):
    """Largest deviation of the mean over the meshes, and of one mesh, from theory [%], and where.

    given: as of ``scaled``.
    """
    ours, theory = scaled(made, *given)
    of_mean = abs(ours.mean(axis=0) - theory.mean(axis=0))
    worst, where = abs(ours - theory).max(), MIDDLES[of_mean.argmax()]
    return float(100.0 * of_mean.max()), float(100.0 * worst), float(where)


def figures_of_lobes(made):
    """Largest deviation of each lobe from theory, by its peak, where it is largest, its size."""
    figures = {"elastic_tetrahedra": (max(one["bodies"] for one in made), "1")}
    waves, static = (np.mean([one[key] for one in made], axis=0) for key in ("speeds", "static"))
    for wave, name in enumerate("ps"):
        for k, elements in enumerate(ELEMENTS):
            error = largest_error(made, wave, k)[0]
            figures[f"{name}_lobe_error_at_{elements:g}_percent"] = error, "%"
        _, worst, where = largest_error(made, wave, ASKED)
        figures[f"{name}_lobe_error_of_one_mesh_percent"] = worst, "%"
        figures[f"{name}_lobe_error_largest_deg"] = where, "degree"
        there = largest_error(made, wave, ASKED, "ours_there", "there")[0]
        figures[f"{name}_error_with_near_field_percent"] = there, "%"
        ours, _ = scaled(made, wave, ASKED)
        figures[f"{name}_largest_deg"] = float(MIDDLES[ours.mean(axis=0).argmax()]), "degree"
        sizes = [max(one["ours"][wave][ASKED]) / max(one["far"][wave][ASKED]) for one in made]
        figures[f"{name}_size_over_theory"] = float(np.mean(sizes)), "1"
        figures[f"{name}_speed_m_s"] = float(waves[ASKED, wave]), "m/s"
        figures[f"{name}_speed_in_statics_m_s"] = float(static[wave]), "m/s"
    return figures


def figures_of_shots(peaks):
    """What burden and damage change behind a hole, with bars, and the powers of the distance."""
    figures, burdens = {}, [name for name in peaks if name.endswith(" m")]
    for name in burdens:
        powers = [-np.polyfit(np.log(BEHIND), np.log(row), 1)[0] for row in peaks[name]]
        figures.update(with_bar(f"exponent at burden {name}", powers))
    pairs = {(name, burdens[-1]): range(len(BEHIND)) for name in burdens[:-1]}
    outside = np.flatnonzero(np.array(BEHIND) > REACH)
    for damage in ("cracked", "weaker"):
        pairs[damage, f"{DAMAGED:g} m"] = outside
        pairs[f"{damage}, gas expands", "fresh, gas expands"] = outside
    for (name, other), chosen in pairs.items():
        ratios = peaks[name][:, chosen] / peaks[other][:, chosen]
        means = np.exp(np.log(ratios).mean(axis=1))
        mean, bar = means.mean(), half_range(means)
        words = "distinguished" if abs(mean - 1.0) > bar else "not distinguished"
        print(f"{name} over {other}: {mean:.3f} ± {bar:.3f}, {words} from 1")
        key = f"{name} over {other.partition(',')[0]}"
        figures.update(with_bar(f"burden {key}" if name in burdens else key, means))
    return figures


def with_bar(words, values):
    """Figures of a mean over the meshes and of its bar."""
    key = words.replace(",", "").replace(" m", "").replace(" ", "_")
    return {key: (float(np.mean(values)), "1"), f"{key}_bar": (float(half_range(values)), "1")}


def draw(path, made, peaks):
    """Lobes, S on the left and P on the right of the hole; peak velocity behind by burden."""
    with picture(path, 0, size=(8.4, 4.0) if peaks else (4.8, 4.0)) as (figure, _):
        draw_lobes(figure.add_subplot(1, 2 if peaks else 1, 1, projection="polar"), made)
        if peaks:
            draw_peaks(figure.add_subplot(1, 2, 2), peaks)


def draw_lobes(axes, made):
    """Theory as a line, ours as dots with bars over the meshes, the hole upright."""
    for wave, (name, side, colour) in enumerate((("P", 1.0, BLUE), ("S", -1.0, RED))):
        ours, far = scaled(made, wave, ASKED)
        angle, mean = side * np.radians(MIDDLES), far.mean(axis=0)
        axes.fill_between(angle, mean - 0.1, mean + 0.1, color=GREY, alpha=0.25, lw=0.0)
        axes.plot(angle, mean, color=BLACK, lw=2.0, label="" if wave else "theory ± 10 %")
        look = {"fmt": "o", "ms": 8, "color": colour, "label": f"{name}, ours"}
        axes.errorbar(angle, ours.mean(axis=0), half_range(ours), **look)
    axes.plot([0.0, 0.0], [0.0, 1.15], color=GREY, lw=5.0, alpha=0.6, label="hole")
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set(thetamin=-90, thetamax=90, ylim=(0.0, 1.15), yticks=[0.5, 1.0], yticklabels=[])
    ticks = np.arange(-90, 91, 30)
    axes.set_xticks(np.radians(ticks), [f"{abs(one)}°" for one in ticks])
    axes.set_title("A charge in elastic rock: S left, P right", loc="center")
    axes.set_xlabel("amplitude by its peak [1] by direction [degrees]", labelpad=-40.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.1), ncols=2)


def draw_peaks(axes, peaks):
    """Peak velocities over the distance behind, with bars over the meshes."""
    burdens = [name for name in peaks if name.endswith(" m")]
    for name, colour, mark in zip(burdens, (BLUE, GREEN, RED), "osD"):
        rows = peaks[name]
        look = {"fmt": f"{mark}-", "ms": 7, "color": colour, "capsize": 4}
        axes.errorbar(BEHIND, rows.mean(axis=0), half_range(rows), label=name, **look)
    axes.set(xscale="log", yscale="log", xlabel="distance behind the hole [m]")
    axes.set_xticks(BEHIND, [f"{away:g}" for away in BEHIND])
    axes.set_yticks([0.25, 0.5, 1.0, 2.0, 4.0], ["0.25", "0.5", "1", "2", "4"])
    axes.set(ylabel="peak velocity [m/s]", title="Does the burden change what shakes?")
    axes.minorticks_off()
    axes.legend(title="burden")
