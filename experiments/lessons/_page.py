"""Parts of a page: sliders, an answer with its picture, and questions that unfold."""

from taichi_dem.kit.session_thread import session


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
    """
    with mo.status.spinner(f"{words} When a lesson is first opened it compiles, some seconds."):
        if is_served(mo):
            session.ask(lesson.compile_all)
        answer = session.ask(work, *choice)
        return answer, session.ask(lesson.picture, answer)


def tell(mo, picture, alt, words, *more):
    """Picture with words, printed where nobody sees the page; more: Markdown below them."""
    if not is_served(mo):
        print(words)
    return mo.vstack([mo.image(picture, alt=alt), *map(mo.md, (words, *more))])


def questions(mo, text):
    """Questions whose answers unfold; text: paragraphs, "Question? :: Answer" each."""
    pairs = (" ".join(part.split()).split(" :: ") for part in text.strip().split("\n\n"))
    return mo.accordion({question: mo.md(answer) for question, answer in pairs})


def percent(share):
    """A share in words: 0.0123 -> 1.2 %, 1.44 -> 144 %."""
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
