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

    import _time_step as lesson
    from _page import ask, guesses, percent, questions, replies, sliders, tell
    from taichi_dem.kit.plot_style import seconds

    _dashpots, _springs = map(seconds, lesson.limits())
    mo.md(f"""
    # What does a time step cost?

    A bar of 72 bodies is struck on its left end. Springs and dashpots hold neighbours together. The
    wave runs to the right, and we watch the far end.

    Halve the step, and the run costs twice as much. What do you get for it?

    Two limits are known before any run: the dashpots of the stiffest body bear an explicit step of
    **{_dashpots}**, its springs one of **{_springs}**.
    """)
    return ask, guesses, lesson, mo, percent, questions, replies, seconds, sliders, tell


@app.cell
def _(lesson, mo, sliders):
    _names = {style.label: name for name, style in lesson.STYLES.items()}
    method = mo.ui.radio(options=_names, value=next(iter(_names)), label="method")
    chosen = sliders(mo, lesson.CHOICES)
    mo.hstack([method, mo.vstack(list(chosen.elements.values()))], justify="start", gap=3)
    return chosen, method


@app.cell
def _(ask, chosen, lesson, method, mo, percent, seconds, tell):
    _choice = method.value, 1e-9 * chosen.value["step"], 1e-6 * chosen.value["rise"]
    _answer, _picture = ask(mo, "Striking.", lesson, lesson.answer, *_choice)
    _strike, _error = _answer.chosen, percent(_answer.chosen.error(_answer.truth))
    _words = f"The program says: *{_strike.sentence}.*"
    if not _strike.sentence:
        _words = f"With {seconds(_strike.step)} a step the far end is wrong by **{_error}** at most"
        _words += f", for **{seconds(_strike.seconds)}** of one core."
    tell(mo, _picture, "Bar, far end, error over cost", _words)
    return


@app.cell
def _(guesses, mo, questions):
    asked = questions("""
    Explicit: go from 80 to 160 ns. What does the error do? :: it doubles | it grows to four times |
    *none is left to name: the run diverges :: At 80 ns it was wrong by 0.01 %: what bounds the step
    is **stability**, not accuracy. You pay for small steps only because a larger one is impossible.

    Solved together: go from 160 to 80 ns. What is left of the error? :: as much as before | *about
    a quarter | half :: The dashpots act in the middle of the step: **second order**. The explicit
    error halves, **first order**: a dashpot takes the velocity of half a step ago.

    Limited dashpots do not diverge up to 1280 ns. How wrong are they at 320 ns? :: *by about half |
    hardly, as they are stable | by 4 % :: A dashpot that the step does not bear is weakened until
    the step bears it. That is another material: wrong by 4 % at 80 ns. **Stable is not right.** At
    40 ns nothing is weakened, and both explicit runs agree.

    You want 1 %. What costs least? :: explicit, 80 ns | *solved together, 2560 ns | limited, 1280
    ns :: One of its steps costs several explicit ones, but it is 32 times as long as the longest
    explicit one here. Limited dashpots are wrong by 80 % there. Beyond 3 µs the springs end the
    run: they are explicit in every method.

    Make the blow gentler, from 10 to 50 µs. Which error falls at 80 ns? :: both | the explicit one
    | *that of the dashpots solved together :: To a twentieth or less: what changes slowly needs few
    steps. The explicit error hardly changes. Its dashpots lag by half a step, whatever the blow.
    """)
    guessed = guesses(mo, asked)
    return asked, guessed


@app.cell
def _(asked, guessed, mo, replies):
    replies(mo, asked, guessed)
    return


if __name__ == "__main__":
    app.run()
