"""Pictures of ``damper_maps.py``."""

import numpy as np

from ca_damper import collect_and_collide
from taichi_dem.kit.plot_style import BLACK, picture, styles_of

#: Points of the theory's curve.
FINE = 400


def picture_jump(path, maps):
    """Energy and apparent mass over amplitude without gravity, with the theory as a line."""
    with picture(path, 1, 2, (9.2, 4.2)) as (figure, axes):
        first = next(iter(maps.values()))
        size, gap = np.array(first.amplitudes), float(first.gaps[0, 0])
        fine = np.linspace(gap / np.pi * (1.0 + 1e-9), max(size.max(), 0.4 * gap), FINE)
        theory = collect_and_collide(fine, gap)
        words = "energy taken in a cycle\n/ (N m A² ω²) [1]", "apparent mass / (N m) [1]"
        for axis, name, label in zip(axes, ("energy", "mass_share"), words):
            curve = theory.energy if name == "energy" else theory.mass
            axis.plot(np.pi * fine / gap, curve, color=BLACK, lw=1.0, label="collect and collide")
            for filling, made in maps.items():
                style, values = styles_of(maps)[filling], getattr(made, name)[0, 0, :, 0, :]
                middle = values.mean(axis=1)
                bars = [middle - values.min(axis=1), values.max(axis=1) - middle]
                look = {"color": style.colour, "marker": style.marker, "ms": 4, "lw": 1.0}
                axis.errorbar(np.pi * size / gap, middle, bars, label=style.label, **look)
            axis.axvline(1.0, color=BLACK, lw=0.8, ls=":", label="jump of the theory")
            axis.set(xlabel="π × amplitude / gap [1]", ylabel=label)
        axes[0].set_ylim(0.0, None)
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=4)


def picture_maps(path, maps, gravity):
    """Loss and apparent mass over frequency and amplitude: a column a filling."""
    rows = (
        ("loss", "loss\nc / (N m ω) [1]", "viridis"),
        ("mass_share", "apparent mass\n/ (N m) [1]", "cividis"),
    )
    with picture(path, 2, len(maps), (9.2, 7.0), sharex=True, sharey=True) as (figure, axes):
        for panels, (name, words, colours) in zip(axes, rows):
            shown = {k: getattr(one, name)[0, 0].mean(axis=-1) for k, one in maps.items()}
            low = min(0.0, *(float(one.min()) for one in shown.values()))
            high = max(float(one.max()) for one in shown.values())
            for axis, (filling, made) in zip(panels, maps.items()):
                x, y = np.array(made.frequencies), 1e3 * np.array(made.amplitudes)
                ends = edges(x), edges(y)
                mesh = axis.pcolormesh(*ends, shown[filling], vmin=low, vmax=high, cmap=colours)
                draw_lines(axis, x, gravity)
                spans = {"xlim": ends[0][[0, -1]], "ylim": ends[1][[0, -1]]}
                axis.set(xscale="log", yscale="log", **spans)
                axis.set_title(styles_of(maps)[filling].label)
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


def draw_lines(axis, x, gravity):
    """Amplitudes at which the largest acceleration is 1, 3 and 10 times gravity."""
    fine = np.geomspace(*edges(x)[[0, -1]], FINE)
    for times, line in ((1, "-"), (3, "--"), (10, ":")):
        size = 1e3 * times * gravity / (2.0 * np.pi * fine) ** 2
        axis.plot(fine, size, color="white", ls=line, lw=2.6)
        axis.plot(fine, size, color=BLACK, ls=line, lw=1.2, label=f"A ω² = {times} g")
