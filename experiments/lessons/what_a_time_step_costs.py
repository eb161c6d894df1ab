"""Lesson: what does a time step cost?

    make lessons                                          # in the browser, with sliders
    python experiments/lessons/what_a_time_step_costs.py  # the first answer, without one

The class reads a question, moves a slider, sees, and then unfolds the answer.
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="What does a time step cost?")


@app.cell
def _():
    import marimo as mo

    import _time_step as lesson
    from _engine import engine
    from _pictures import percent, picture_time_step
    from taichi_dem.kit.plot_style import seconds

    served = mo.app_meta().mode in ("run", "edit")
    return engine, lesson, mo, percent, picture_time_step, seconds, served


@app.cell
def _(lesson, mo, seconds):
    _dashpots, _springs = lesson.limits()
    mo.md(
        f"""
        # What does a time step cost?

        A bar of 72 bodies is struck on its left end. Springs and dashpots hold neighbours
        together. The wave runs to the right, and we watch the far end.

        Halve the step, and the run costs twice as much. What do you get for it?

        Two limits are known before any run: the dashpots of the stiffest body bear an explicit
        step of **{seconds(_dashpots)}**, its springs one of **{seconds(_springs)}**.
        """
    )
    return


@app.cell
def _(lesson, mo):
    method = mo.ui.radio(
        options={words: name for name, words in lesson.WORDS.items()},
        value=lesson.WORDS["explicit"],
        label="method",
    )
    _look = {"show_value": True, "debounce": True}
    _steps = [round(1e9 * one) for one in lesson.STEPS]
    _rises = [round(1e6 * one) for one in sorted(lesson.RISES)]
    step = mo.ui.slider(steps=_steps, value=80, label="step [ns]", **_look)
    rise = mo.ui.slider(steps=_rises, value=20, label="the blow rises in [µs]", **_look)
    mo.hstack([method, mo.vstack([step, rise])], justify="start", gap=3)
    return method, rise, step


@app.cell
def _(engine, lesson, method, mo, percent, picture_time_step, rise, seconds, served, step):
    _choice = method.value, lesson.nearest(lesson.STEPS, 1e-9 * step.value)
    with mo.status.spinner("Striking. When a lesson is first opened it compiles, some seconds."):
        if served:
            engine.ask(lesson.compile_all)
        _answer = engine.ask(
            lesson.answer, *_choice, lesson.nearest(lesson.RISES, 1e-6 * rise.value)
        )
        _picture = engine.ask(picture_time_step, _answer)
    _chosen = _answer.chosen
    if _chosen.sentence:
        _words = f"The program says: *{_chosen.sentence}.*"
    else:
        _error = percent(_chosen.error(_answer.truth))
        _words = (
            f"With {seconds(_chosen.step)} a step the far end is wrong by **{_error}** at most, "
            f"for **{seconds(_chosen.seconds)}** of one core."
        )
    if not served:
        print(_words)
    mo.vstack([mo.image(_picture, alt="Bar, far end, error over cost"), mo.md(_words)])
    return


@app.cell
def _(lesson, mo):
    mo.accordion({question: mo.md(answer) for question, answer in lesson.QUESTIONS.items()})
    return


if __name__ == "__main__":
    app.run()
