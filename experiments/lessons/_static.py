"""The lessons as static pages: one HTML file each, with all that it shows, and no server.

    python experiments/lessons/_static.py [--quick] [--out results/lessons]

A page asks the questions of a lesson one by one, each with the one control that it is about; the
pictures of that control's values are SVG, packed. What a picture shows of earlier choices is what
a reader has seen who takes the questions in their order.
"""

import argparse
import base64
import importlib
import io
import time
import zlib
from pathlib import Path

import matplotlib
from markdown_it import MarkdownIt
from matplotlib.backends.backend_svg import FigureCanvasSVG

import _page as page
import taichi_dem.kit.viewer
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.session_thread import session

LESSONS = "_time_step", "_answers", "_grains", "_needs"
#: Questions, and values of a control, of a quick page.
QUICK = 2
#: Paragraphs and tables to HTML; HTML among the words is shown as it is typed.
MARKDOWN = MarkdownIt("commonmark", {"html": False}).enable("table")
HERE = Path(__file__).resolve().parent
VIEWER = Path(taichi_dem.kit.viewer.__file__).parent


def page_of(lesson, quick=False):
    """The page of a lesson as text; on the thread of the session."""
    from jinja2 import Environment, FileSystemLoader

    options = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    template = Environment(loader=FileSystemLoader(HERE), **options).get_template("_static.html")
    style = (VIEWER / "page.css").read_text(encoding="utf-8")
    data = content_of(lesson, quick)
    return template.render(title=data["title"], style=style, data=data)


def content_of(lesson, quick=False):
    """What the page of a lesson holds, fit for JSON: texts are HTML, pictures are ``packed``.

    A question has words, guesses, right, replies; values, first, frames of its control named
    label. A frame has words, and wide and tall, numbers of its pictures.
    """
    opening, asked = page.parts_of(lesson)
    heading, _, words = opening.partition("\n")
    asked = page.questions(asked)[: QUICK if quick else None]
    frames = Frames(lesson)
    return {
        "title": heading.removeprefix("# "),
        "opening": MARKDOWN.render(words),
        "alt": lesson.ALT,
        "hint": page.HEADING.removeprefix("## "),
        "questions": [_question(lesson, one, frames, quick) for one in asked],
        "pictures": list(frames.pictures),
    }


def _question(lesson, question, frames, quick):
    """A question with the Frames of its control."""
    fixed = {name: option_of(lesson, name, text) for name, text in question.fixed.items()}
    values = {name: first_of(*one[:2]) for name, one in lesson.CONTROLS.items()} | fixed
    control = question.control
    options = options_of(lesson.CONTROLS[control][0])
    first = [*options.values()].index(values[control])
    if quick:
        begin = min(first, len(options) - QUICK)
        options, first = dict([*options.items()][begin : begin + QUICK]), first - begin
    shown = [frames.of({**values, control: one}) for one in options.values()]
    return {
        "words": MARKDOWN.renderInline(question.words),
        "guesses": list(map(MARKDOWN.renderInline, question.guesses)),
        "right": question.guesses.index(question.right),
        "replies": [MARKDOWN.render(page.reply(question, guess)) for guess in question.guesses],
        "label": lesson.CONTROLS[control][2],
        "values": list(options),
        "first": first,
        "frames": shown,
    }


class Frames:
    """Frames of the choices of a lesson; pictures: number by picture."""

    def __init__(self, lesson):
        self.lesson, self.pictures, self._known = lesson, {}, {}

    def of(self, values):
        """Words and pictures of the answer to a choice, as before if it is the same answer."""
        answer, key = self.lesson.answer(**values), tuple(values.items())
        known, frame = self._known.get(key, (None, None))
        if known != answer:
            frame = {"words": MARKDOWN.render(self.lesson.words(answer))}
            frame |= {"wide": self._picture(answer, False), "tall": self._picture(answer, True)}
            self._known[key] = answer, frame
        return frame

    def _picture(self, answer, tall):
        """Number of a picture."""
        made = packed(page.picture(self.lesson, answer, svg_of, tall))
        return self.pictures.setdefault(made, len(self.pictures))


def options_of(values):
    """Values of a control by their labels."""
    if isinstance(values, dict):
        return values
    return {"on": True, "off": False} if values is bool else {f"{one:g}": one for one in values}


def option_of(lesson, name, text):
    """Value of a control as a text names it; a name that is no control is a switch."""
    values = options_of(lesson.CONTROLS.get(name, (bool,))[0]).items()
    return next(one for label, one in values if text in (label, one))


def first_of(values, first):
    """The value with which a control begins."""
    return values[first] if isinstance(values, dict) else first


def svg_of(figure):
    """A figure as SVG, the same bytes each time; letters are outlines, so no font is needed."""
    content = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "lesson"}):
        FigureCanvasSVG(figure).print_svg(content, metadata={"Date": None})
    return content.getvalue()


def packed(content):
    """Bytes as the page unpacks them: deflated, in base64."""
    return base64.b64encode(zlib.compress(content, 9)).decode("ascii")


def build(name, folder, quick=False):
    """Write the page of the lesson in a module of this name; returns its path."""
    lesson = importlib.import_module(name)
    path = Path(folder, f"{lesson.PAGE}.html")
    write_text(path, session.ask(page_of, lesson, quick))
    return path


def main(arguments=None):
    """Write all pages, and print where they are, how large, and how long it took."""
    parser = argparse.ArgumentParser(description="Write the lessons as static HTML pages.")
    parser.add_argument("--quick", action="store_true", help="few questions and values")
    parser.add_argument("--out", default="results/lessons", help="folder of the pages")
    options = parser.parse_args(arguments)
    folder = output_folder(options.out)
    for name in LESSONS:
        started = time.perf_counter()
        path = build(name, folder, options.quick)
        spent = time.perf_counter() - started
        print(f"{path}  {path.stat().st_size / 1e6:.2f} MB, {spent:.0f} s", flush=True)
    session.close()


if __name__ == "__main__":
    main()
