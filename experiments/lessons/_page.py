"""Parts of a page: sliders, an answer with its picture, and questions to guess at."""

from typing import NamedTuple

from taichi_dem import InputError, SimulationDiverged
from taichi_dem.kit.plot_style import png_of
from taichi_dem.kit.session_thread import session

#: A scene of a lesson is too small for two threads: they wait for each other longer than they work.
session.threads = 1


def sliders(mo, choices):
    """Sliders by name, which answer when let go; choices: name -> (steps, first, label)."""
    shown = {"show_value": True, "debounce": True}
    return mo.ui.dictionary(
        {
            name: mo.ui.slider(steps=list(steps), value=first, label=label, **shown)
            for name, (steps, first, label) in choices.items()
        }
    )


def is_served(mo):
    """Whether somebody sees the page."""
    return mo.app_meta().mode in ("run", "edit")


def ask(mo, words, lesson, work, *choice):
    """Answer of a lesson to a choice, and the picture of it; words: while one waits.

    On a page that is served all is compiled first, so that no later answer has to wait for it.
    Where the program ends the run, its sentence stands in the place of both.
    """
    with mo.status.spinner(f"{words} When a lesson is first opened it compiles, some seconds."):
        if is_served(mo):
            session.ask(session.kept, ("compiled", lesson.__name__), lesson.compile_all)
        try:
            answer = session.ask(work, *choice)
        except SimulationDiverged as told:
            mo.stop(True, mo.callout(mo.md(f"The program says: *{told}.*"), kind="warn"))
        return answer, session.ask(lesson.picture, answer)


def tell(mo, picture, alt, words, *more):
    """Picture with words, printed where nobody sees the page; more: Markdown below them."""
    if not is_served(mo):
        print(words)
    return mo.vstack([mo.image(picture, alt=alt), *map(mo.md, (words, *more))])


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

    text: paragraphs "Question? :: guess | *right guess | guess :: Answer"; two to four guesses, one
    of them starred.
    """
    return [_question(" ".join(part.split())) for part in text.strip().split("\n\n")]


def _question(text):
    """The Question that a paragraph states."""
    parts = text.split(" :: ")
    if len(parts) != 3 or not all(parts):
        raise InputError(f'a question must read "Question? :: guesses :: Answer", got {text!r}')
    words, choices, answer = parts
    given = [one.strip() for one in choices.split("|")]
    plain = tuple(one.removeprefix("*").strip() for one in given)
    right = [guess for guess, one in zip(plain, given) if guess != one]
    if not 2 <= len(set(plain)) == len(plain) <= 4 or not all(plain):
        raise InputError(f"{words!r} must have two to four different guesses, got {choices!r}")
    if len(right) != 1:
        raise InputError(f"{words!r} must have one right guess, with a star, got {len(right)}")
    return Question(words, plain, right[0], answer)


def guesses(mo, asked):
    """Radio buttons of each Question, none of them chosen."""
    return mo.ui.array([mo.ui.radio(one.guesses, label=f"**{one.words}**") for one in asked])


def replies(mo, asked, chosen):
    """Each Question with its buttons, and below them the answer once there is a guess."""
    rows = [mo.md("## Guess first")]
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
