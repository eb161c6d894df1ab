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
    from _page import ask, guesses, questions, replies, sliders, tell

    mo.md(f"""
    # What does an answer cost?

    A bar of 72 bodies is struck on its left end. How far has its right end moved after
    **{1e6 * lesson.UNTIL:g} µs**, when the wave gets there?

    Name the error that you allow, and nothing else. The program chooses the method and its steps,
    runs what is needed, and returns a value with an **error bar**. What do you pay for a narrow
    one, and can you believe it?
    """)
    return ask, guesses, lesson, mo, questions, replies, sliders, tell


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
def _(guesses, mo, questions):
    asked = questions("""
    Ask for 30 %, then for 10 %. How much more does the second cost? :: *nothing | three times |
    nine times :: No bar comes from a single run. The least that the program can do is to run its
    longest stable step and half of it, and to see how far the two lie apart. Where that is already
    enough, a wider tolerance saves nothing.

    The true error is smaller than the bar. What does that say of the bar? :: it is too wide | the
    truth lies in its middle | *nothing is wrong with it :: The program does not know the truth. It
    sees how the values change when the step is halved, and takes what is left from that. A bar must
    hold the truth in **95 of 100** scenes; in most of them the error is smaller.

    Ask for 30 %, then for 0.01 %: the bar gets 500 times narrower. How many times shorter is the
    step? :: *16 | 250 | 500 :: The sentence below the picture names the steps: 1.5 µs and 96 ns.
    The method is of **second order**: half of the step leaves a quarter of the error, a sixteenth
    about a 250th. With a method of first order it would be 500 times shorter, at 500 times the
    cost.

    Can you not just run the smallest step that you can afford, once? :: yes: a smaller step is a
    better answer | yes, if it is stable | *no: nobody knows how good it is :: You have a number.
    You do not know its error, and so you do not know whether you have paid too little or too much.

    The bar holds together. If bonds broke, what would limit a narrower bar? :: nothing: halve the
    step | *runs that part by a rounding | the longest stable step :: Then the last digit of a
    number may decide whether a bond breaks. No step makes a bar narrower than the spread of such
    runs. The program makes such twins, says by how much they differ, and offers the **mean** of
    many.
    """)
    guessed = guesses(mo, asked)
    return asked, guessed


@app.cell
def _(asked, guessed, mo, replies):
    replies(mo, asked, guessed)
    return


if __name__ == "__main__":
    app.run()
