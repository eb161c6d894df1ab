"""Tables of tunnel rounds: means over meshes with their bars, what differs, what a bar costs."""

import numpy as np

from taichi_dem.kit.bars.chance import t_quantile

#: What is compared between designs, with its unit.
COMPARED = {
    "beside_m_s": "m/s",
    "behind_m_s": "m/s",
    "exponent": "1",
    "radiated_kJ": "kJ",
    "out_m3": "m3",
    "out_m_s": "m/s",
    "depth_m": "m",
}
#: Half-width of a bar that is asked for, as a share of the value.
ASKED = 0.05


def with_bars(rows):
    """A row a design: means over the meshes of the finer size, and their bars, NAME_bar each.

    A bar is half of the 95 % range of the mean by Student's t, and the difference to the mean of
    the coarser size; NaN of one mesh. rows: a table, a row a run.
    """
    kept = rows.drop(columns=["holes", "error", "version", "commit", "machine"], errors="ignore")
    by_size = [own.drop(columns="near_m") for _, own in kept.groupby("near_m")]
    finer, *coarser = (own.groupby("design", sort=False) for own in by_size)
    mean, count = finer.mean(), finer.size()
    wide = count.map(lambda n: t_quantile(0.95, n - 1) if n > 1 else np.nan)
    bar = finer.std().mul(wide / np.sqrt(count), axis=0)
    for other in coarser:
        bar = bar + (other.mean() - mean).abs()
    return mean.join(bar.add_suffix("_bar"))


def compared(table):
    """Rows in words: value and bar of each design, and whether it differs from the first."""
    rows = []
    for name, unit in COMPARED.items():
        value, bar = table[name], table[f"{name}_bar"]
        apart = (value - value.iloc[0]).abs() > np.hypot(bar, bar.iloc[0])
        words = [f"{v:.3g} +- {b:.2g}" if b == b else f"{v:.3g}" for v, b in zip(value, bar)]
        notes = ["", *("" if known else " (not distinguished)" for known in apart[1:])]
        rows.append([f"{name} [{unit}]", *(a + b for a, b in zip(words, notes))])
    return rows


def price(rows):
    """Meshes, and CPU seconds, after which the first design's peak velocity beside it is known.

    Known to ``ASKED``, by the spread over the meshes of the finer size; zeros of one mesh.
    """
    own = rows[(rows.near_m == rows.near_m.min()) & (rows.design == rows.design.iloc[0])]
    if len(own) < 2:
        return 0, 0.0
    spread = own.beside_m_s.std() / own.beside_m_s.mean()
    meshes = max(2, int(np.ceil((1.96 * spread / ASKED) ** 2)))
    return meshes, meshes * float(own.cpu_s.mean())
