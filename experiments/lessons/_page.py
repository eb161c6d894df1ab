"""Parts of a page: its controls, an answer with its picture, and questions to guess at.

A lesson is a module with PAGE, the name of its text; CONTROLS, name -> (values, first, label);
WAIT, what one waits for; ALT, what the picture shows; SIZE and TALL, of the picture and of a
narrow one for a telephone [inches]; and functions: ``answer(**values)``, ``words(answer)`` and
``draw(figure, answer, tall)`` of it. It may have ``facts()``, texts by name for the braces of its
text, and ``preparation()``, pieces of work that spare later answers a wait.
"""

import functools
import sys
import threading
from pathlib import Path
from typing import NamedTuple

from taichi_dem import InputError, SimulationDiverged
from taichi_dem.kit.plot_style import png_of, styled
from taichi_dem.kit.session_thread import session

# What lessons share with other experiments lies in the folder above.
sys.path.append(str(Path(__file__).resolve().parents[1]))
#: A scene of a lesson is too small for two threads: they wait for each other longer than they work.
session.threads = 1
#: Between the opening of a page and its questions.
HEADING = "## Guess first"


def parts_of(lesson):
    """Opening, with facts in its braces, and questions of the text of a lesson, Markdown."""
    text = Path(__file__).with_name(f"{lesson.PAGE}.md").read_text(encoding="utf-8")
    words, asked = text.split(HEADING)
    return words.format(**getattr(lesson, "facts", dict)()), asked


def controls(mo, lesson):
    """Sliders, switches and choices of a lesson by name; sliders answer when let go."""
    given = lesson.CONTROLS.items()
    return mo.ui.dictionary({name: _control(mo, *one) for name, one in given})


def _control(mo, values, first, label):
    """A switch for a bool, a choice of the keys of a dict, a slider for steps."""
    if isinstance(values, dict):
        return mo.ui.radio(options=values, value=first, label=label)
    if values is bool:
        return mo.ui.switch(value=first, label=label)
    look = {"show_value": True, "debounce": True}
    return mo.ui.slider(steps=list(values), value=first, label=label, **look)


def opening(mo, lesson, chosen, *more):
    """The first words, and the controls in two columns."""
    shown = [*chosen.elements.values(), *more]
    half = -(-len(shown) // 2)
    columns = [mo.vstack(shown[:half]), mo.vstack(shown[half:])]
    words = mo.md(parts_of(lesson)[0])
    return mo.vstack([words, mo.hstack(columns, justify="start", gap=3)], gap=1)


def answered(mo, lesson, values):
    """Picture and words of the answer to a choice; printed where nobody sees the page.

    Where the program ends the run, its sentence stands in the place of both.
    """
    served = mo.app_meta().mode in ("run", "edit")
    wait = f"{lesson.WAIT} A lesson compiles for some seconds when it is first opened."
    with mo.status.spinner(wait):
        try:
            answer = session.ask(lambda: lesson.answer(**values))
        except SimulationDiverged as told:
            return mo.callout(mo.md(f"The program says: *{told}.*"), kind="warn")
        shown, words = session.ask(picture, lesson, answer), lesson.words(answer)
    if served:
        _prepare(lesson)
    else:
        print(words)
    return mo.vstack([mo.image(shown, alt=lesson.ALT), mo.md(words)])


@functools.cache
def _prepare(lesson):
    """Prepare later answers behind the first one, which is shown; they take turns with readers."""

    def prepare():
        for piece in getattr(lesson, "preparation", list)():
            session.ask(piece)

    threading.Thread(target=prepare, daemon=True).start()


def picture(lesson, answer, write=png_of, tall=False):
    """The picture of an answer, tall for the narrow one; bytes, by a function write of a figure."""
    with styled(0, size=lesson.TALL if tall else lesson.SIZE) as (figure, _):
        lesson.draw(figure, answer, tall)
        _place_like_the_first(figure, (lesson.PAGE, tall))
        return write(figure)


def _place_like_the_first(figure, name):
    """Put the panels where they lay in the first figure of this name.

    To lay them out anew would take as long as to draw them, and they would jump.
    """

    def laid_out():
        # Room for longer numbers than those of the first.
        figure.get_layout_engine().set(w_pad=0.15, h_pad=0.1)
        figure.draw_without_rendering()
        return [axes.get_position(original=True) for axes in figure.axes]

    places = session.kept(("places", name), laid_out)
    figure.set_layout_engine("none")
    for axes, place in zip(figure.axes, places):
        axes.set_position(place)


class Question(NamedTuple):
    """A question, guesses to choose from, the right one of them, and the answer, Markdown.

    control: what to move for it; fixed: values of controls, by name, all as texts.
    """

    words: str
    guesses: tuple
    right: str
    answer: str
    control: str
    fixed: dict


def questions(text):
    """Read Questions off a text; raises InputError where a paragraph is malformed.

    text: paragraphs "Question? :: guess | *right guess | guess :: Answer :: control, name=value";
    one guess is starred.
    """
    return [_question(" ".join(part.split())) for part in text.strip().split("\n\n")]


def _question(text):
    """The Question that a paragraph states."""
    parts = text.split(" :: ")
    if len(parts) != 4 or not all(parts):
        form = "Question? :: guesses :: Answer :: control"
        raise InputError(f'a question must read "{form}", got {text!r}')
    words, choices, answer, moved = parts
    given = [one.strip() for one in choices.split("|")]
    right = [one.removeprefix("*") for one in given if one.startswith("*")]
    if len(right) != 1:
        raise InputError(f"{words!r} must have one right guess, with a star, got {len(right)}")
    control, *fixed = moved.split(", ")
    others = dict(one.split("=") for one in fixed)
    plain = tuple(one.removeprefix("*") for one in given)
    return Question(words, plain, right[0], answer, control, others)


def guesses(mo, lesson):
    """Radio buttons of each question of a lesson, none of them chosen."""
    asked = questions(parts_of(lesson)[1])
    return mo.ui.array([mo.ui.radio(one.guesses, label=f"**{one.words}**") for one in asked])


def replies(mo, lesson, chosen):
    """Each question with its buttons, and below them the answer once there is a guess."""
    rows = [mo.md(HEADING)]
    asked = questions(parts_of(lesson)[1])
    for question, buttons, guess in zip(asked, chosen.elements, chosen.value):
        rows += [buttons, *([mo.callout(mo.md(reply(question, guess)))] if guess else [])]
    return mo.vstack(rows, gap=1)


def reply(question, guess):
    """The answer to a guess: whether it is right, and why."""
    verdict = "Right." if guess == question.right else f"No: *{question.right}*."
    return f"**{verdict}** {question.answer}"


def percent(share):
    """A share in words: 0.0123 -> 1.2 %, 1.44 -> 144 %."""
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
