"""How much do grains damp, over amplitude and frequency, and what does theory say?

The container is driven as A sin(w t), whatever the grains do. The first map has no gravity, and is
compared with the theory of collect and collide: grains fly as one block between floor and lid and
lose all relative motion at each wall. Expect the loss to jump at A = gap / pi to 4 in units of N m
A^2 w^2, and to fall slowly beyond. The second map has gravity: below A w^2 = g grains lie still and
only add mass; the loss is largest where they are thrown once a cycle, from about 2 g on. A quick
run leaves out the rules of the paper.

    python experiments/damper_maps.py            # two minutes
    python experiments/damper_maps.py --particles 20

Writes collect_and_collide.png, maps.png, a CSV of each map and summary.json to
results/damper_maps/.
"""

import sys
from functools import partial

import numpy as np

from ca_damper import Automaton, Spheres, collect_and_collide, damper_map
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, picture, styles_of
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_maps"
SETTINGS = {
    "particles": (30, 30, study.whole(1, 120), "grains with gravity, default 30"),
    "block": (40, 40, study.whole(10, 120), "grains without gravity, default 40"),
    "seeds": (3, 1, study.whole(1, 100), "seeds of each scene, default 3"),
    # Amplitudes by gap / pi; amplitudes by those of g; frequencies [Hz].
    "ratios": (17, 7),
    "levels": (12, 5),
    "frequencies": (10, 4),
    "cycles": (60, 25),
    # Spheres, and the automaton by the rules of the paper and of place.
    "fillings": ((Spheres, partial(Automaton, rules="paper"), Automaton), (Spheres, Automaton)),
}
#: Base motion without gravity [Hz], and ranges of the axes.
WEIGHTLESS_HZ, RATIOS = 6.0, (0.6, 1.4)
HERTZ, MILLIMETRES = (5.0, 40.0), (0.1, 10.0)
#: Gravity [m/s2], and points of a curve of theory.
GRAVITY, FINE = 9.8, 400
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def picture_jump(path, maps):
    """Energy and apparent mass over amplitude without gravity, with the theory as a line."""
    first = next(iter(maps.values()))
    size, gap = np.array(first.amplitudes), float(first.gaps[0, 0])
    fine = np.linspace(gap / np.pi * (1.0 + 1e-9), max(size.max(), 0.4 * gap), FINE)
    theory = collect_and_collide(fine, gap)
    panels = {
        "energy": (theory.energy, "energy taken in a cycle\n/ (N m A² ω²) [1]"),
        "mass_share": (theory.mass, "apparent mass / (N m) [1]"),
    }
    with picture(path, 1, 2, (9.2, 4.2)) as (figure, axes):
        for axis, (name, (curve, words)) in zip(axes, panels.items()):
            axis.plot(np.pi * fine / gap, curve, color=BLACK, lw=1.0, label="collect and collide")
            for filling, style in styles_of(maps).items():
                values = getattr(maps[filling], name)[0, 0, :, 0, :]
                middle = values.mean(axis=1)
                bars = [middle - values.min(axis=1), values.max(axis=1) - middle]
                look = {"color": style.colour, "marker": style.marker, "ms": 4, "lw": 1.0}
                axis.errorbar(np.pi * size / gap, middle, bars, label=style.label, **look)
            axis.axvline(1.0, color=BLACK, lw=0.8, ls=":", label="jump of the theory")
            axis.set(xlabel="π × amplitude / gap [1]", ylabel=words)
        axes[0].set_ylim(0.0, None)
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)


def picture_maps(path, maps):
    """Loss and apparent mass over frequency and amplitude: a column a filling."""
    first, rows = next(iter(maps.values())), {"loss": "loss\nc / (N m ω) [1]"}
    rows["mass_share"] = "apparent mass\n/ (N m) [1]"
    x, y = edges(np.array(first.frequencies)), edges(1e3 * np.array(first.amplitudes))
    fine = np.geomspace(x[0], x[-1], FINE)
    with picture(path, 2, len(maps), (9.2, 7.0), sharex=True, sharey=True) as (figure, axes):
        for panels, (name, words), colours in zip(axes, rows.items(), ("viridis", "cividis")):
            shown = {k: getattr(one, name)[0, 0].mean(axis=-1) for k, one in maps.items()}
            every = np.array([*shown.values()])
            ends = {"vmin": min(0.0, every.min()), "vmax": every.max(), "cmap": colours}
            for axis, (filling, style) in zip(panels, styles_of(maps).items()):
                mesh = axis.pcolormesh(x, y, shown[filling], **ends)
                for times, line in ((1, "-"), (3, "--"), (10, ":")):
                    size = 1e3 * times * GRAVITY / (2.0 * np.pi * fine) ** 2
                    axis.plot(fine, size, color="white", ls=line, lw=2.6)
                    label = f"A ω² = {times} g"
                    axis.plot(fine, size, color=BLACK, ls=line, lw=1.2, label=label)
                axis.set(xscale="log", yscale="log", xlim=x[[0, -1]], ylim=y[[0, -1]])
                axis.set_title(style.label)
            figure.colorbar(mesh, ax=panels, label=words)
        for axis in axes[-1]:
            axis.set_xlabel("frequency [Hz]")
        for axis in axes[:, 0]:
            axis.set_ylabel("amplitude [mm]")
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=3)


def edges(centres):
    """Edges of cells around centres whose logarithms are even."""
    half = np.sqrt(centres[1] / centres[0])
    return np.append(centres / half, centres[-1] * half)


def jump_of(ratios, energy):
    """Where the energy passes half of its largest value for good, from below; None if nowhere."""
    low = np.flatnonzero(energy < 0.5 * energy.max())
    if not len(low) or low[-1] == len(energy) - 1:
        return None
    k = low[-1]
    share = (0.5 * energy.max() - energy[k]) / (energy[k + 1] - energy[k])
    return float(ratios[k] + share * (ratios[k + 1] - ratios[k]))


def run(options):
    """Map all fillings without and with gravity, compare, picture."""
    folder, half = study.begin(options), options.cycles // 2
    cycles = {"transient_cycles": half, "measured_cycles": options.cycles - half}
    few, jumps, maps, figures = {"seeds": options.seeds, **cycles}, {}, {}, {}
    gap = 96e-3 - 6e-3 * options.block / 10
    weightless = {
        "amplitudes": gap / np.pi * np.linspace(*RATIOS, options.ratios),
        **{"frequencies": WEIGHTLESS_HZ, "particles": options.block},
    }
    heavy = {
        "amplitudes": 1e-3 * np.geomspace(*MILLIMETRES, options.levels),
        "frequencies": np.geomspace(*HERTZ, options.frequencies),
        "particles": options.particles,
    }
    jobs = {"weightless": (0.0, weightless, jumps), "gravity": (GRAVITY, heavy, maps)}
    for make in options.fillings:
        for name, (gravity, axes, made) in jobs.items():
            filling = make(gravity=gravity)
            label = make().label
            with ProgressBar(f"{label}, gravity {gravity:g} m/s2") as bar:
                made[label] = damper_map(filling, **axes, **few, progress=bar)
            made[label].write_csv(folder / f"{name}_{label}.csv")
    picture_jump(folder / "collect_and_collide.png", jumps)
    picture_maps(folder / "maps.png", maps)
    for label, made in jumps.items():
        energy = made.energy[0, 0, :, 0].mean(axis=-1)
        ratios = np.pi * np.array(made.amplitudes) / made.gaps[0, 0]
        flat = (energy / made.theory.energy[0, 0])[ratios > 1.05]
        figures[f"jump_ratio_{label}"] = jump_of(ratios, energy), "1"
        figures[f"plateau_share_{label}"] = float(flat.mean()), "1"
    for label, made in maps.items():
        loss = made.loss[0, 0].mean(axis=-1)
        i, j = np.unravel_index(np.argmax(loss), loss.shape)
        level = made.amplitudes[i] * (2.0 * np.pi * made.frequencies[j]) ** 2 / GRAVITY
        figures[f"largest_loss_{label}"] = float(loss.max()), "1"
        figures[f"largest_loss_at_g_{label}"] = float(level), "g"
    reports = [report for one in (*jumps.values(), *maps.values()) for report in one.reports]
    study.finish(options, NAME, figures, reports, see="collect_and_collide.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
