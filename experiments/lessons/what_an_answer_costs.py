"""Lesson: what does an answer cost? Read the question, move the slider, see, unfold the answer.

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
    from _page import ask, questions, sliders, tell

    mo.md(f"""
    # What does an answer cost?

    A bar of 72 bodies is struck on its left end. How far has its right end moved after
    **{1e6 * lesson.UNTIL:g} µs**, when the wave gets there?

    Name the error that you allow, and nothing else. The program chooses the method and its steps,
    runs what is needed, and returns a value with an **error bar**. What do you pay for a narrow
    one, and can you believe it?
    """)
    return ask, lesson, mo, questions, sliders, tell


@app.cell
def _(lesson, mo, sliders):
    chosen = sliders(mo, lesson.CHOICES)
    chosen.elements["tolerance"]
    return (chosen,)


@app.cell
def _(ask, chosen, lesson, mo, tell):
    _answer, _picture = ask(mo, "Asking.", lesson, lesson.answer, chosen.value["tolerance"])
    _alt = "Answers with their bars, bars and true errors, and CPU time over the error allowed"
    tell(mo, _picture, _alt, lesson.words(_answer))
    return


@app.cell
def _(mo, questions):
    _text = """
    Ask for 30 %, then for 10 %. Why may both cost the same? :: No bar comes from a single run. The
    least that the program can do is to run its longest stable step and half of it, and to see how
    far the two lie apart. Where that is already enough, a wider tolerance saves nothing.

    The true error is smaller than the bar. Is the bar too wide? :: The program does not know the
    truth. It sees how the values change when the step is halved, and takes what is left from that.
    A bar must hold the truth in **95 of 100** scenes; in most of them the error is smaller.

    Go from 3 to 0.03 %. What would you expect to pay? :: The method is of **second order**: half of
    the step leaves a quarter of the error. A hundredth of the error takes a tenth of the step,
    about ten times the time. With a method of first order it would be a hundred times.

    Can you not just run the smallest step that you can afford? :: Then you have a number. You do
    not know its error, and so you do not know whether you have paid too little or too much.

    The bar holds together. What if bonds broke? :: Then the last digit of a number may decide
    whether one breaks, and runs that differ by one rounding part. No step makes a bar narrower
    than their spread. The program makes such twins, says by how much they differ, and offers the
    **mean** of many.
    """
    questions(mo, _text)
    return


if __name__ == "__main__":
    app.run()
