"""What a figure must say for itself, and a way to run an experiment while its figures are read.

    python tests/figures.py REPORT experiments/NAME.py ARGUMENTS

runs the experiment as if it were called directly and writes to REPORT, a JSON file, what its
figures lack: {"figures": count, "defects": [sentence]}.
"""

import json
import os
import re
import runpy
import sys

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

CODE_NAME = re.compile(r"[A-Za-z0-9]_[A-Za-z0-9]")
COMMIT = re.compile(r"commit \w+")
MATHS = re.compile(r"\$[^$]*\$")
UNIT = re.compile(r"\[[^\]]+\]")
#: What no number has: two letters side by side, or the sign before a commit.
NAME = re.compile("[a-z]{2}|^@")
#: The program's own sentences are quoted as they are.
QUOTE = re.compile(r"“[^”]*”", re.DOTALL)


def defects(figure):
    """Sentences: names of the code, words cut off, axes without a unit."""
    units = [words for axes in figure.axes for words in missing_units(axes)]
    return [*code_names(figure), *clipped_words(figure), *units]


def texts_of(figure):
    """All texts that one sees; ticks beyond the limits are not drawn."""
    hidden = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            every = (*axis.get_major_ticks(), *axis.get_minor_ticks())
            unseen = [t for t in every if not (axes.axison and low <= t.get_loc() <= high)]
            hidden.update(text for tick in unseen for text in tick.findobj(Text))
            if not axes.axison:
                hidden.update(axis.findobj(Text))
    shown = figure.findobj(Text)
    return [t for t in shown if t.get_visible() and t.get_text() and t not in hidden]


def code_names(figure):
    """Names of the code in what a figure says."""
    for text in texts_of(figure):
        words = text.get_text()
        if CODE_NAME.search(COMMIT.sub("", QUOTE.sub("", MATHS.sub("", words)))):
            yield f"a name of the code in {words!r}"


def clipped_words(figure):
    """Words that end outside the figure; a pixel is no loss."""
    (left, bottom), (right, top) = figure.bbox.get_points()
    for text in texts_of(figure):
        box = text.get_window_extent().padded(-1.0)
        if box.x0 < left or box.y0 < bottom or box.x1 > right or box.y1 > top:
            yield f"{text.get_text()!r} is cut off at the edge of the figure"


def missing_units(axes):
    """Axes with numbers but without a label that ends with its unit."""
    if not axes.get_visible() or not axes.axison or axes.get_label() == "<colorbar>":
        return
    for axis in (axes.xaxis, axes.yaxis):
        words = axis.get_label_text()
        if has_numbers(axis) and not UNIT.search(words):
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
        with open(path, "w", encoding="utf-8") as file:
            json.dump({"figures": len(seen), "defects": sorted(set(found))}, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
