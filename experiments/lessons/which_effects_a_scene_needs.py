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
    speed = mo.ui.slider(
        steps=list(lesson.SPEEDS),
        value=2.0,
        label="the right end starts with [m/s]",
        show_value=True,
        debounce=True,
    )
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
def _(mo):
    mo.accordion(
        {
            "Pull gently, with 0.2 m/s. Which effects can you switch off, and how do you know?": (
                mo.md(
                    "All but the dashpots. The table says *never acted*: without an effect that "
                    "never acted **not a bit** of the answer differs. Switch off fracture, slip, "
                    "contact and friction, and the change stays zero."
                )
            ),
            "Pull with 2 m/s and switch off the contact. What do you see, what does the program "
            "say?": mo.md(
                "The pieces pass through each other when the bar is pressed together. The run ends "
                "without a word of error: **every figure looks fine**. Only the last row tells: "
                "bodies overlap, *list it*. A program that stays silent here would be dangerous."
            ),
            "Switch off fracture. Why is contact then never missed?": mo.md(
                "Nothing breaks, so nothing comes loose that could touch. Effects hang together: "
                "ask for one, and others follow."
            ),
            "A hard pull makes the program warn of sphere dashpots. How wrong is it?": (
                mo.md(
                    "By 0.2 %: so far do the bodies end elsewhere when the step is halved, and the "
                    "warning stays. Twice as long a step would be wrong by 2 %. A warning is a "
                    "reason to try a shorter step, and not yet an error."
                )
            ),
            "Which effect is dear, and is it the one that matters most?": mo.md(
                "Leave out one at a time and press the button. Dear and important are two "
                "things: look at the share of the energy in the table, and at where the bodies end."
            ),
            "Fracture takes 2 % of the energy. Can it go?": mo.md(
                "No. It *steers*: it takes little and decides where everything goes. The program "
                "never drops such an effect because its energy is small, only because it never "
                "acted."
            ),
        }
    )
    return


if __name__ == "__main__":
    app.run()
