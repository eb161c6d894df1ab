"""Parts of a page: sliders, and questions whose answers unfold."""


def sliders(mo, choices):
    """Sliders by name, which answer when let go; choices: name -> (steps, first, label)."""
    shown = {"show_value": True, "debounce": True}
    return mo.ui.dictionary(
        {
            name: mo.ui.slider(steps=list(steps), value=first, label=label, **shown)
            for name, (steps, first, label) in choices.items()
        }
    )


def questions(mo, text):
    """Questions whose answers unfold; text: paragraphs, "Question? :: Answer" each."""
    pairs = (" ".join(part.split()).split(" :: ") for part in text.strip().split("\n\n"))
    return mo.accordion({question: mo.md(answer) for question, answer in pairs})


def percent(share):
    """A share in words: 0.0123 -> 1.2 %, 1.44 -> 144 %."""
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
