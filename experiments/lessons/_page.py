"""Parts of a page: its controls, an answer with its picture, and questions to guess at.

A lesson is a module with PAGE, the name of its text; CONTROLS, name -> (values, first, label);
WAIT, what one waits for; ALT, what the picture shows; and functions: ``answer(**values)``,
``words(answer)`` and ``picture(answer)`` of it, and ``compile_all()``.
"""

from pathlib import Path
from typing import NamedTuple

from taichi_dem import InputError, SimulationDiverged
from taichi_dem.kit.plot_style import png_of
from taichi_dem.kit.session_thread import session

#: A scene of a lesson is too small for two threads: they wait for each other longer than they work.
session.threads = 1
#: Between the opening of a page and its questions.
HEADING = "## Guess first"


def parts_of(lesson):
    """Opening and questions of the text of a lesson, Markdown."""
    text = Path(__file__).with_name(f"{lesson.PAGE}.md").read_text(encoding="utf-8")
    return text.split(HEADING)


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


def opening(mo, lesson, chosen, *more, **facts):
    """The first words, with facts in their braces, and the controls in two columns."""
    shown = [*chosen.elements.values(), *more]
    half = -(-len(shown) // 2)
    columns = [mo.vstack(shown[:half]), mo.vstack(shown[half:])]
    words = mo.md(parts_of(lesson)[0].format(**facts))
    return mo.vstack([words, mo.hstack(columns, justify="start", gap=3)], gap=1)


def answered(mo, lesson, values):
    """Picture and words of the answer to a choice; printed where nobody sees the page.

    On a page that is served all is compiled first, so that no later answer has to wait for it.
    Where the program ends the run, its sentence stands in the place of both.
    """
    served = mo.app_meta().mode in ("run", "edit")
    wait = f"{lesson.WAIT} When a lesson is first opened it compiles, some seconds."
    with mo.status.spinner(wait):
        if served:
            session.ask(session.kept, ("compiled", lesson.PAGE), lesson.compile_all)
        try:
            answer = session.ask(lambda: lesson.answer(**values))
        except SimulationDiverged as told:
            return mo.callout(mo.md(f"The program says: *{told}.*"), kind="warn")
        picture, words = session.ask(lesson.picture, answer), lesson.words(answer)
    if not served:
        print(words)
    return mo.vstack([mo.image(picture, alt=lesson.ALT), mo.md(words)])


def png_like_the_first(figure, name):
    """A figure as PNG, its panels where they lay in the first figure of this name.

    To lay them out anew would take as long as to draw them, and they would jump.
    """

    def laid_out():
        # Room for longer numbers than those of the first.
        figure.get_layout_engine().set(w_pad=0.15)
        figure.draw_without_rendering()
        return [axes.get_position(original=True) for axes in figure.axes]

    places = session.kept(("places", name), laid_out)
    figure.set_layout_engine("none")
    for axes, place in zip(figure.axes, places):
        axes.set_position(place)
    return png_of(figure)


class Question(NamedTuple):
    """A question, guesses to choose from, the right one of them, and the answer, Markdown."""

    words: str
    guesses: tuple
    right: str
    answer: str


def questions(text):
    """Read Questions off a text; raises InputError where a paragraph is malformed.

    text: paragraphs "Question? :: guess | *right guess | guess :: Answer"; one guess is starred.
    """
    return [_question(" ".join(part.split())) for part in text.strip().split("\n\n")]


def _question(text):
    """The Question that a paragraph states."""
    parts = text.split(" :: ")
    if len(parts) != 3 or not all(parts):
        raise InputError(f'a question must read "Question? :: guesses :: Answer", got {text!r}')
    words, choices, answer = parts
    given = [one.strip() for one in choices.split("|")]
    right = [one.removeprefix("*") for one in given if one.startswith("*")]
    if len(right) != 1:
        raise InputError(f"{words!r} must have one right guess, with a star, got {len(right)}")
    return Question(words, tuple(one.removeprefix("*") for one in given), right[0], answer)


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
    verdict = "Right." if guess == question.right else f"Not so, but: *{question.right}*."
    return f"**{verdict}** {question.answer}"


def percent(share):
    """A share in words: 0.0123 -> 1.2 %, 1.44 -> 144 %."""
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
