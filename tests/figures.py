"""What a figure must say for itself, and a way to run an experiment while its figures are read.

    python tests/figures.py REPORT experiments/NAME.py ARGUMENTS

runs the experiment as if it were called directly and writes to REPORT, a JSON file, what its
figures lack: {"figures": count, "defects": [sentence]}.
"""

import itertools
import json
import os
import re
import runpy
import sys

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.colors import to_hex, to_rgb
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from taichi_dem.kit.plot_style import STYLES

CODE_NAME = re.compile(r"[A-Za-z0-9]_[A-Za-z0-9]")
PROGRAM_NUMBER = re.compile(r"\d[eE][-+]?\d+(?![0-9a-zA-Z])")
COMMIT = re.compile(r"commit \w+")
MATHS = re.compile(r"\$[^$]*\$")
UNIT = re.compile(r"\[[^\]]+\]")
#: What no number has: two letters side by side, or the sign before a commit.
NAME = re.compile("[a-z]{2}|^@")
#: The program's own sentences are quoted as they are.
QUOTE = re.compile(r"“[^”]*”", re.DOTALL)
#: Width of a page [inch], and the smallest letters on it [pt].
PAGE, SMALLEST = 180.0 / 25.4, 6.5
LABELS = sorted(((s.label, s.colour) for s in STYLES.values()), key=lambda pair: -len(pair[0]))


def defects(figure):
    """Sentences: what a drawn figure lacks; none if it says all that it shows."""
    words = [text.get_text() for text in texts_of(figure)]
    found = [*bad_words_in(words), *other_colours(figure), *unexplained_lines(figure)]
    found += [*small_letters(figure), *clipped_words(figure)]
    for axes in figure.axes:
        found += [*missing_units(axes), *covered_data(axes), *lines_alike(axes)]
    return found


def texts_of(figure):
    """All texts that one sees, artists."""
    shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    hidden = {
        text
        for axes in figure.axes
        for text in axes.findobj(Text)
        if not axes.axison and text in (*axes.xaxis.findobj(Text), *axes.yaxis.findobj(Text))
    }
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            hidden.update(label for tick in ticks_beyond(axis) for label in tick.findobj(Text))
    return [text for text in shown if text not in hidden]


def ticks_beyond(axis):
    """Ticks that are not drawn, as they lie beyond the limits."""
    low, high = sorted(axis.get_view_interval())
    every = (*axis.get_major_ticks(), *axis.get_minor_ticks())
    return [tick for tick in every if not low <= tick.get_loc() <= high]


def small_letters(figure):
    """Letters that are too small where a figure is as wide as a page, or as it is if narrower."""
    scale = min(1.0, PAGE / figure.get_figwidth())
    small = [text for text in texts_of(figure) if scale * text.get_fontsize() < SMALLEST]
    if small:
        words = sorted({text.get_text() for text in small})
        size = scale * min(text.get_fontsize() for text in small)
        yield f"letters of {size:.1f} pt at a width of 180 mm: {words[0]!r}, {len(words)} in all"


def clipped_words(figure):
    """Words that end outside the figure; a pixel is no loss."""
    (left, bottom), (right, top) = figure.bbox.get_points()
    for text in texts_of(figure):
        box = text.get_window_extent().padded(-1.0)
        if box.x0 < left or box.y0 < bottom or box.x1 > right or box.y1 > top:
            yield f"{text.get_text()!r} is cut off at the edge of the figure"


def data_lines(axes):
    """Lines that show data; those that run along an axis from edge to edge are guides."""
    return [
        line
        for line in axes.lines
        if line.get_visible() and len(line.get_xdata()) and line.get_transform() == axes.transData
    ]


def covered_data(axes):
    """Data that a legend lies on."""
    for legend in axes.findobj(Legend):
        box = legend.get_window_extent()
        covered = any(crosses(line, box) for line in data_lines(axes))
        bars = [patch for container in axes.containers for patch in container.get_children()]
        covered |= any(bar.get_window_extent().overlaps(box) for bar in bars if is_area(bar))
        covered |= any(reaches(collection, box) for collection in axes.collections)
        if covered or axes.images:
            words = legend.get_texts()[0].get_text()
            yield f"the legend of {words!r} lies on data, in {axes.get_title('left')!r}"


def is_area(artist):
    """Whether an artist is a bar that one sees."""
    return isinstance(artist, Patch) and artist.get_visible()


def crosses(line, box):
    """Whether a line, or a marker of it, lies in a box of the display."""
    path = line.get_transform().transform_path(line.get_path()).cleaned(remove_nans=True)
    marked = line.get_marker() not in ("None", "", None)
    inside = marked and any(box.contains(*place) for place in path.vertices)
    drawn = line.get_linestyle() != "None" and len(path.vertices) > 2
    return inside or (drawn and path.intersects_bbox(box, filled=False))


def reaches(collection, box):
    """Whether paths of a collection lie in a box of the display; images of cells are data all."""
    if isinstance(collection, QuadMesh):
        return collection.axes.get_window_extent().overlaps(box)
    if isinstance(collection, PathCollection):
        places = collection.get_offset_transform().transform(collection.get_offsets())
        return any(box.contains(*place) for place in places)
    filled = len(collection.get_facecolor()) > 0
    paths = map(collection.get_transform().transform_path, collection.get_paths())
    return any(path.intersects_bbox(box, filled=filled) for path in paths if len(path.vertices))


def lines_alike(axes):
    """Lines of different colours that only their hue tells apart; rows of marks stand apart."""
    looks = {look_of(line): line for line in data_lines(axes) if not is_row(line)}
    for (one, first), (other, second) in itertools.combinations(looks.items(), 2):
        same_form = one[1:] == other[1:] and abs(first.get_lw() - second.get_lw()) < 1.0
        if same_form and one[0] != other[0] and abs(lightness(one[0]) - lightness(other[0])) < 12:
            both = f"{one[0]} and {other[0]}"
            yield f"lines in {both} differ in hue only, in {axes.get_title('left')!r}"


def is_row(line):
    """Whether a line is a row of marks."""
    return line.get_linestyle() == "None" and np.ptp(line.get_ydata()) == 0.0


def look_of(line):
    """Colour, dashes and marker of a line."""
    dashes = line.get_linestyle(), str(line._unscaled_dash_pattern)
    return to_hex(line.get_color()), dashes, str(line.get_marker())


def lightness(colour):
    """Lightness L* of a colour, from 0 black to 100 white (CIE 1976)."""
    share = np.array(to_rgb(colour))
    linear = np.where(share > 0.04045, ((share + 0.055) / 1.055) ** 2.4, share / 12.92)
    luminance = float(linear @ (0.2126, 0.7152, 0.0722))
    return 116.0 * luminance ** (1.0 / 3.0) - 16.0 if luminance > 0.008856 else 903.3 * luminance


def bad_words_in(texts):
    """Names of the code and numbers as a program prints them."""
    for text in texts:
        plain = COMMIT.sub("", QUOTE.sub("", MATHS.sub("", text)))
        if CODE_NAME.search(plain):
            yield f"a name of the code in {text!r}"
        if PROGRAM_NUMBER.search(plain):
            yield f"a number as programs print it in {text!r}"


def legends_of(figure):
    """All legends of a figure and its axes."""
    return figure.findobj(Legend)


def entries_of(figure):
    """(Words, handle) of all legends."""
    for legend in legends_of(figure):
        words = [text.get_text() for text in legend.get_texts()]
        yield from zip(words, legend.legend_handles)


def colour_of(artist):
    """Colour as #rrggbb, None where the artist has none of its own or several."""
    for name in ("get_color", "get_facecolor"):
        if hasattr(artist, name):
            value = np.atleast_2d(np.asarray(getattr(artist, name)(), dtype=object))
            value = getattr(artist, name)() if value.shape[0] <= 1 else None
            if value is not None and len(value):
                return to_hex(value if isinstance(value, str) else np.ravel(value))
    return None


def other_colours(figure):
    """Methods and fillings in a colour that is not that of the table."""
    for words, handle in entries_of(figure):
        for label, colour in LABELS:
            if label in words:
                seen = colour_of(handle)
                if seen and seen.lower() != to_hex(colour).lower():
                    yield f"{words!r} is drawn in {seen}, and {label!r} is {colour}"
                break


def unexplained_lines(figure):
    """Dashed and dotted lines and bands that no legend of the figure names."""
    styles = {line.get_linestyle() for key in legends_of(figure) for line in key.findobj(Line2D)}
    for axes in figure.axes:
        for line in axes.lines:
            look = line.get_linestyle()
            drawn = line.get_visible() and len(line.get_xdata()) and look not in ("-", "None")
            if drawn and look not in styles:
                yield f"no legend says what a line {look} means, in {axes.get_title('left')!r}"
        for stripe in stripes_of(axes):
            if colour_of(stripe) not in {colour_of(handle) for _, handle in entries_of(figure)}:
                yield f"no legend says what a stripe means, in {axes.get_title('left')!r}"
        bands = [c for c in axes.collections if type(c).__name__ == "FillBetweenPolyCollection"]
        bands = [band for band in bands if band.get_alpha() is not None]
        if bands and not any(hasattr(h, "get_facecolor") for _, h in entries_of(figure)):
            yield f"no legend says what the band means, in {axes.get_title('left')!r}"


def stripes_of(axes):
    """Coloured areas that are no bars."""
    if axes.get_label() == "<colorbar>" or not axes.axison:
        return []
    bars = {id(patch) for container in axes.containers for patch in container}
    return [patch for patch in axes.patches if id(patch) not in bars]


def missing_units(axes):
    """Axes with numbers but without a label that ends with its unit."""
    if not axes.get_visible() or not axes.axison:
        return
    named = [UNIT.search(axis.get_label_text()) for axis in (axes.xaxis, axes.yaxis)]
    if axes.get_label() == "<colorbar>":
        words = [t.get_text() for axis in (axes.xaxis, axes.yaxis) for t in axis.get_ticklabels()]
        if not any(named) and not any(re.search("[a-zµ]", word) for word in words):
            yield "a colour bar without a unit"
        return
    for axis, unit in zip((axes.xaxis, axes.yaxis), named):
        if not unit and has_numbers(axis):
            words = axis.get_label_text()
            yield f"axis {axis.axis_name} ({words!r}) without a unit, of {axes.get_title('left')!r}"


def has_numbers(axis):
    """Whether an axis shows numbers at its ticks; words need no unit, nor the name of a commit."""
    ticks = [label for label in axis.get_ticklabels() if label.get_visible()]
    words = [label.get_text() for label in ticks if label.get_text()]
    return bool(words) and not any(NAME.search(MATHS.sub("", word)) for word in words)


def watch(report):
    """Note what every figure lacks that is drawn from now on, once a figure, in a list."""
    drawn, seen = FigureCanvasAgg.draw, {}

    def draw(canvas):
        drawn(canvas)
        # A figure is kept, as another one could get its number.
        if id(canvas.figure) not in seen:
            seen[id(canvas.figure)] = canvas.figure
            report.extend(defects(canvas.figure))

    FigureCanvasAgg.draw = draw
    return seen


def main(path, script, *arguments):
    """Run the experiment and write the report however it ends."""
    sys.argv = [script, *arguments]
    sys.path[0] = os.path.dirname(os.path.abspath(script))
    found = []
    seen = watch(found)
    try:
        runpy.run_path(script, run_name="__main__")
    finally:
        kept = [sentence for sentence, _ in itertools.groupby(sorted(found))]
        with open(path, "w", encoding="utf-8") as file:
            json.dump({"figures": len(seen), "defects": kept}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
