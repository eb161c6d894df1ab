"""Lesson: what does a time step cost? Read, guess, move a slider, see.

make lessons                                          # in the browser, with sliders
python experiments/lessons/what_a_time_step_costs.py  # the first answer, without one
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="What does a time step cost?")


@app.cell
def _():
    import marimo as mo

    import _page as page
    import _time_step as lesson

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
