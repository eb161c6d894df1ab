"""Lesson: which effects does my scene need?

    make lessons                                               # in the browser, with switches
    python experiments/lessons/which_effects_a_scene_needs.py  # the first answer, without one

The class reads a question, moves a slider, sees, and then unfolds the answer.
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Which effects does my scene need?")


@app.cell
def _():
    import marimo as mo

    import _needs as lesson
    from _engine import engine
    from _pictures import percent, picture_needs

    served = mo.app_meta().mode in ("run", "edit")
    return engine, lesson, mo, percent, picture_needs, served


@app.cell
def _(mo):
    mo.md("""
    # Which effects does my scene need?

    A bar is held on the left. Its right end is pulled out and a little down, and then pressed
    back in. Switch effects off: what is not listed is not computed, not stored, not compiled.

    A good scene lists what it needs, and nothing else.
    """)
    return


@app.cell
def _(lesson, mo):
    listed = mo.ui.dictionary(
        {name: mo.ui.switch(value=True, label=words) for name, words in lesson.WORDS.items()}
    )
    _look = {"show_value": True, "debounce": True}
    _words = "the right end starts with [m/s]"
    speed = mo.ui.slider(steps=list(lesson.SPEEDS), value=2.0, label=_words, **_look)
    measure = mo.ui.run_button(label="measure what this choice costs (compiles it, some seconds)")
    _switches = mo.vstack(list(listed.elements.values()))
    mo.hstack([_switches, mo.vstack([speed, measure])], justify="start", gap=3)
    return listed, measure, speed


@app.cell
def _(engine, lesson, listed, measure, mo, percent, picture_needs, served, speed):
    _names = lesson.allowed([name for name, on in listed.value.items() if on])
    with mo.status.spinner("Pulling. When a lesson is first opened it compiles, some seconds."):
        if served:
            engine.ask(lesson.compile_all)
        _work = lesson.price if measure.value else lesson.answer
        _answer = engine.ask(_work, _names, speed.value)
        _picture = engine.ask(picture_needs, _answer)
    _spared = 1.0 - _answer.chosen.step_s / _answer.complete.step_s
    _known = _spared == _spared
    _spares = f"spares **{percent(max(0.0, _spared))}** of a step" if _known else "is not measured"
    _change = "no comparison" if _answer.change is None else percent(_answer.change)
    _words = (
        f"The end is pulled out by **{1e3 * _answer.stroke:.2g} mm**. Your choice {_spares}; "
        f"bodies end elsewhere by **{_change}**."
    )
    if _answer.chosen.sentence:
        _words += f" The program says: *{_answer.chosen.sentence}.*"
    for _warning in _answer.chosen.unresolved:
        _words += f" It warns: *{_warning}.*"
    _rows = [
        f"| {words} | {'yes' if on else 'no'} | {did} | **{says}** |"
        for words, on, did, says in lesson.verdicts(_answer)
    ]
    _head = ["| effect | listed | what it did | the program says |", "|---|---|---|---|"]
    if not served:
        print(_words)
    mo.vstack(
        [
            mo.image(_picture, alt="Bar with all effects and with those chosen, cost of a step"),
            mo.md(_words),
            mo.md("\n".join([*_head, *_rows])),
        ]
    )
    return


@app.cell
def _(lesson, mo):
    mo.accordion({question: mo.md(answer) for question, answer in lesson.QUESTIONS.items()})
    return


if __name__ == "__main__":
    app.run()
