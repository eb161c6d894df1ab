"""Lesson: which effects does my scene need? Read, guess, move a switch, see.

make lessons                                               # in the browser, with switches
python experiments/lessons/which_effects_a_scene_needs.py  # the first answer, without one
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Which effects does my scene need?")


@app.cell
def _():
    import marimo as mo

    import _needs as lesson
    import _page as page

    chosen, guessed = page.controls(mo, lesson), page.guesses(mo, lesson)
    measure = mo.ui.run_button(label="measure what this choice costs (compiles it first)")
    page.opening(mo, lesson, chosen, measure)
    return chosen, guessed, lesson, measure, mo, page


@app.cell
def _(chosen, lesson, measure, mo, page):
    page.answered(mo, lesson, {**chosen.value, "measured": measure.value})
    return


@app.cell
def _(guessed, lesson, mo, page):
    page.replies(mo, lesson, guessed)
    return


if __name__ == "__main__":
    app.run()
