"""One look for all pictures of both packages."""

import contextlib
import io
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from PIL import Image

from taichi_dem.kit.files import write_bytes, write_whole
from taichi_dem.kit.progress import drawing
from taichi_dem.kit.validation import FileName

STYLE = {
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    # 0.01, 0.1, 1 instead of powers of ten on logarithmic axes.
    "axes.formatter.min_exponent": 4,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
}

#: Pixels of a PNG picture in a notebook or on a page, and of one in a file, per inch.
PNG_DPI, _FILE_DPI = 110, 150
#: Okabe and Ito's colours, which colour-blind readers can distinguish.
BLUE, RED, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, BLACK, GREY = "#E69F00", "#56B4E9", "#222222", "#8A8A8A"
BROWN, VIOLET, NAVY = "#8C6D31", "#6A51A3", "#0B2545"
WINE, LIGHT_GREY = "#882255", "#ADADAD"


@dataclass(frozen=True)
class MethodStyle:
    """How a method or a filling looks in every picture: legend entry, colour, marker, line."""

    label: str
    colour: str
    marker: str
    line: str | tuple[float, tuple[float, ...]] = "-"


_LONG_DASHES, _DASH_DOT_DOT = (0.0, (8.0, 2.0)), (0.0, (5.0, 1.5, 1.0, 1.5, 1.0, 1.5))
#: Styles by name; those that share a picture differ in colour, and without it in marker and line.
STYLES = {
    "uniform": MethodStyle("paper's rule, one step for all", RED, "o"),
    "multirate_held": MethodStyle("paper's rule, multirate", BLUE, "s", "--"),
    "multirate_drifted": MethodStyle(
        "paper's rule, multirate, neighbours drifted", GREEN, "D", _DASH_DOT_DOT
    ),
    "controlled": MethodStyle("multirate, step control", ORANGE, "^", "-."),
    "limited": MethodStyle("one fixed step, limited dashpots", PURPLE, "v", _LONG_DASHES),
    "implicit": MethodStyle("one fixed step, solved dashpots", SKY, "P", "--"),
    "fixed": MethodStyle("one fixed step, full dashpots", BLACK, "X"),
    "reference": MethodStyle("reference", GREY, ".", ":"),
    "ca_static": MethodStyle("automaton, static contact", BLUE, "o"),
    "ca_place": MethodStyle("automaton, rules of place", WINE, "P", ":"),
    "ca_ejection": MethodStyle("automaton, landing + ejection", GREEN, "s", "-."),
    "ca_landing": MethodStyle("automaton, landing", ORANGE, "D"),
    "dem": MethodStyle("spheres", RED, "^", "--"),
    "dem_printed": MethodStyle("spheres, damping as printed", PURPLE, "v", _LONG_DASHES),
    "dem_soft": MethodStyle("spheres, modulus / 100", SKY, "P"),
    "empty": MethodStyle("empty container", LIGHT_GREY, "X", ":"),
}
#: Other names of the same.
_SAME = {
    **{"paper_uniform": "uniform", "paper_multirate": "multirate_held", "held": "multirate_held"},
    **{"drifted": "multirate_drifted", "multirate_controlled": "controlled"},
    **{"explicit_limited": "limited", "solved": "implicit", "explicit": "fixed"},
    **{"automaton": "ca_static", "automaton_ejection": "ca_ejection", "spheres": "dem"},
    **{"automaton_landing": "ca_landing", "spheres_printed": "dem_printed", "dem_tsuji": "dem"},
}
#: Colours of lines that have no style of their own.
SPARE_COLOURS = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BROWN, VIOLET)


def styles_of(names: Iterable[str]) -> dict[str, MethodStyle]:
    """MethodStyle of each name: that of ``STYLES``, or else the name itself and a spare colour."""
    own = {name: STYLES.get(_SAME.get(name, name)) for name in names}
    taken = {style.colour for style in own.values() if style}
    spare = [colour for colour in SPARE_COLOURS if colour not in taken] or list(SPARE_COLOURS)
    others = [name for name, style in own.items() if style is None]
    styles = {
        name: MethodStyle(name, spare[k % len(spare)], "osD^vPX"[k % 7], ("-", "--")[k % 2])
        for k, name in enumerate(others)
    }
    return {name: style or styles[name] for name, style in own.items()}


def colour_table(name: str, low: float = 0.0, high: float = 1.0) -> np.ndarray:
    """256 colours of a part of a map of matplotlib, (256, 3) uint8; low, high: shares of it."""
    return table_of(matplotlib.colormaps[name](np.linspace(low, high, 256)))


def table_of(colours: np.ndarray) -> np.ndarray:
    """Colours (n, 3 or 4) in [0, 1] as 256 of equal parts, (256, 3) uint8."""
    return np.rint(255.0 * colours[np.arange(256) * len(colours) // 256, :3]).astype(np.uint8)


def line_key(label: str, **look: Any) -> Line2D:
    """A line or marker for a legend alone; look: as of ``Axes.plot``."""
    return Line2D([], [], label=label, **look)


def area_key(label: str, **look: Any) -> Patch:
    """A coloured area for a legend alone; look: facecolor, edgecolor, alpha."""
    return Patch(label=label, **look)


class NotebookFigure(Figure):
    """A figure that shows itself as the last line of a notebook's cell, also without pyplot."""

    def _repr_png_(self) -> bytes:
        with matplotlib.rc_context(STYLE):
            return png_of(self)


@contextlib.contextmanager
def styled(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (6.4, 4.2), **options: Any
) -> Iterator[tuple[Figure, Any]]:
    """A figure and its axes in the common style, which holds to the end of the block."""
    with matplotlib.rc_context(STYLE):
        figure = NotebookFigure(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        yield figure, figure.subplots(rows, columns, **options) if rows else None


@contextlib.contextmanager
def picture(
    path: FileName | None, *shape: Any, dpi: Any = _FILE_DPI, **options: Any
) -> Iterator[tuple[Figure, Any]]:
    """A figure and its axes, as of ``styled``, written as PNG when the block ends well."""
    if path is not None:
        drawing(path)
    with styled(*shape, **options) as (figure, axes):
        yield figure, axes
        if path is None:
            return
        write_bytes(path, png_of(figure, dpi))


def png_of(figure: Figure, dpi: float = PNG_DPI) -> bytes:
    """A figure as PNG, in bytes; within the block of ``styled``."""
    # ``Figure.savefig`` would draw the figure twice, the first time for its layout.
    content, usual = io.BytesIO(), figure.dpi
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(dpi)
    canvas.print_png(content)
    figure.set_dpi(usual)
    return content.getvalue()


@contextlib.contextmanager
def filming(
    size: tuple[float, float], dpi: float, style: Mapping[str, Any]
) -> Iterator[tuple[Figure, Callable[[], None], list[Image.Image]]]:
    """A figure, a function that takes it as the next image, and the RGB images taken so far."""
    with matplotlib.rc_context(style):
        figure = Figure(figsize=size, dpi=dpi, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        images: list[Image.Image] = []
        background: Any = None

        def shoot():
            nonlocal background
            if images:
                background = _draw_changes(canvas, background)
            else:
                canvas.draw()
                figure.set_layout_engine("none")
            images.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[:, :, :3].copy()))

        yield figure, shoot, images


def _draw_changes(canvas, background):
    """Draw what has changed once and what lies over it; returns the pixels of all else."""
    figure = canvas.figure
    moving = [
        artist
        for container in (*map(_layers, figure.axes), figure.texts)
        for artist in _over(container)
    ]
    if background is None or not all(artist.get_animated() for artist in moving):
        for artist in moving:
            artist.set_animated(True)
        canvas.draw()
        background = canvas.copy_from_bbox(figure.bbox)
    canvas.restore_region(background)
    for artist in moving:
        artist.draw(canvas.get_renderer())
        # An empty text is left stale.
        artist.stale = False
    return background


def _layers(axes):
    """Artists of axes in the order in which they are drawn."""
    hidden = [axes.patch]
    if not axes.axison:
        hidden += [axes.xaxis, axes.yaxis, *axes.spines.values()]
    shown = (artist for artist in axes.get_children() if artist not in hidden)
    return sorted(shown, key=Artist.get_zorder)


def _over(layers):
    """Artists from the first on that has changed, now or before."""
    return itertools.dropwhile(lambda artist: not (artist.stale or artist.get_animated()), layers)


def seconds(value: float) -> str:
    """A time in words, with a unit that keeps the number readable: 3.125e-10 -> 0.313 ns."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def write_gif(
    path: FileName,
    images: Sequence[Image.Image],
    milliseconds: float,
    colours: int = 64,
    samples: int = 8,
) -> None:
    """Write RGB images as a GIF with one palette, made from some of them, evenly over the whole."""
    width, height = images[0].size
    picked = np.linspace(0, len(images) - 1, samples).round().astype(int)
    sheet = Image.new("RGB", (width, samples * height))
    for row, index in enumerate(picked):
        sheet.paste(images[index], (0, row * height))
    # Median cut counts pixels, and nearly all are white: the octree keeps rare colours.
    palette = sheet.quantize(colours, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    reduced = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    options = {"append_images": reduced[1:], "duration": milliseconds, "loop": 0}
    write_whole(path, lambda name: reduced[0].save(name, format="GIF", save_all=True, **options))
