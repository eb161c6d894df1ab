"""Lesson: what does a time step cost? Read the question, move a slider, see, unfold the answer.

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
    from _page import ask, percent, questions, sliders, tell
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
    return ask, lesson, mo, percent, questions, seconds, sliders, tell


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
def _(mo, questions):
    _text = """
    Explicit: go from 80 to 160 ns. Does the error grow, or does something else happen? :: The run
    diverges. At 80 ns it was wrong by 0.01 %: what bounds the step is **stability**, not accuracy.
    You pay for small steps only because a larger one is impossible.

    How does each curve fall when the step is halved? :: Explicit: the error halves, **first
    order**. A dashpot takes the velocity of half a step ago. Solved together: the error falls to
    about a quarter, **second order**. The dashpots act in the middle of the step.

    Limited dashpots do not diverge up to 1280 ns. Why not take them? :: A dashpot that the step
    does not bear is weakened until the step bears it. That is another material: wrong by 4 % at
    80 ns, by about half at 320. **Stable is not right.** At 40 ns nothing is weakened, and both
    explicit runs agree.

    You want 1 %. Which method, and which step? :: Dashpots solved together, with the longest step.
    One of its steps costs several explicit ones, but it is 32 times as long as the longest explicit
    one here. Beyond it the springs end the run: they are explicit in every method.

    Make the blow gentler, from 10 to 50 µs. Which error falls? :: At 80 ns that of the solved
    dashpots, to a twentieth: what changes slowly needs few steps. The explicit error hardly
    changes. Its dashpots lag by half a step, whatever the blow.
    """
    questions(mo, _text)
    return


if __name__ == "__main__":
    app.run()
