"""One look for all pictures of both packages."""

import contextlib
import io

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from taichi_dem.files import write_whole

STYLE = {
    "savefig.dpi": 150,
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
}

#: Okabe and Ito's colours, told apart by colour-blind readers too.
BLUE, RED, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, BLACK, GREY = "#E69F00", "#56B4E9", "#222222", "#8A8A8A"


@contextlib.contextmanager
def styled(rows=1, columns=1, size=(6.4, 4.2), **options):
    """A figure and its axes in the common style, which holds to the end of the block.

    size: in inches. rows: 0 for no axes, which the block then makes. options: of
    ``Figure.subplots``. The Agg canvas needs no display.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        yield figure, figure.subplots(rows, columns, **options) if rows else None


@contextlib.contextmanager
def picture(path, *shape, **options):
    """A figure and its axes, as of ``styled``, written as PNG when the block ends well.

    Raises InputError when the file cannot be written.
    """
    with styled(*shape, **options) as (figure, axes):
        yield figure, axes
        write_whole(path, lambda name: figure.savefig(name, format="png"))


def png_of(figure, dpi=110):
    """A figure as PNG, in bytes; within the block of ``styled``."""
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=dpi)
    return content.getvalue()


@contextlib.contextmanager
def filming(size, dpi, style):
    """A figure, a function that takes it as the next image, and the RGB images taken so far.

    size: in inches, at dpi pixels each. style: of matplotlib. The layout stays that of the first
    image, so that nothing jumps.
    """
    with matplotlib.rc_context(style):
        figure = Figure(figsize=size, dpi=dpi, layout="constrained")
        canvas, images = FigureCanvasAgg(figure), []

        def shoot():
            """Take the figure as the next image."""
            canvas.draw()
            images.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[:, :, :3].copy()))
            figure.set_layout_engine("none")

        yield figure, shoot, images


def seconds(value):
    """A time in words, with a unit that keeps the number readable: 3.125e-10 -> 0.313 ns."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def write_gif(path, images, milliseconds, colours=64, samples=8):
    """Write RGB images as a GIF with one palette, made from some of them, evenly over the whole.

    milliseconds: a frame. Raises InputError when the file cannot be written.
    """
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
