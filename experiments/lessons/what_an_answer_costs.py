"""Lesson: what does an answer cost? Read, guess, move the slider, see.

make lessons                                         # in the browser, with a slider
python experiments/lessons/what_an_answer_costs.py  # the first answer, without one
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="What does an answer cost?")


@app.cell
def _():
    import marimo as mo

    import _answers as lesson
    import _page as page

    chosen, guessed = page.controls(mo, lesson), page.guesses(mo, lesson)
    page.opening(mo, lesson, chosen)
    return chosen, guessed, lesson, mo, page


@app.cell
def _(chosen, lesson, mo, page):
    page.answered(mo, lesson, chosen.value)
    return


@app.cell
def _(guessed, lesson, mo, page):
    page.replies(mo, lesson, guessed)
    return


if __name__ == "__main__":
    app.run()
