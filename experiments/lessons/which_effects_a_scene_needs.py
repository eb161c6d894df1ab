"""Lesson: which effects does my scene need? Read the question, move a switch, see, unfold.

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
    from _page import ask, questions, sliders, tell

    mo.md("""
    # Which effects does my scene need?

    A bar is held on the left. Its right end is pulled out and a little down, and then pressed back
    in. Switch effects off: what is not listed is not computed, not stored, not compiled. A good
    scene lists what it needs, and nothing else.
    """)
    return ask, lesson, mo, questions, sliders, tell


@app.cell
def _(lesson, mo, sliders):
    listed = mo.ui.dictionary(
        {name: mo.ui.switch(value=True, label=words) for name, (_, words) in lesson.EFFECTS.items()}
    )
    chosen = sliders(mo, {"speed": (lesson.SPEEDS, 2.0, "the right end starts with [m/s]")})
    measure = mo.ui.run_button(label="measure what this choice costs (compiles it, some seconds)")
    _left, _right = list(listed.elements.values()), [chosen.elements["speed"], measure]
    mo.hstack([mo.vstack(_left), mo.vstack(_right)], justify="start", gap=3)
    return chosen, listed, measure


@app.cell
def _(ask, chosen, lesson, listed, measure, mo, tell):
    _names = lesson.allowed(name for name, on in listed.value.items() if on)
    _work = lesson.price if measure.value else lesson.answer
    _answer, _picture = ask(mo, "Pulling.", lesson, _work, _names, chosen.value["speed"])
    _rows = ["| effect | listed | what it did | the program says |", "|---|---|---|---|"]
    for _name, _on, _did, _says in lesson.verdicts(_answer):
        _rows.append(f"| {_name} | {'yes' if _on else 'no'} | {_did} | **{_says}** |")
    _alt = "Bar with all effects and with those chosen, cost of a step"
    tell(mo, _picture, _alt, lesson.words(_answer), "\n".join(_rows))
    return


@app.cell
def _(mo, questions):
    _text = """
    Pull gently, with 0.2 m/s. Which effects can you switch off, and how do you know? :: All but the
    dashpots. The table says *never acted*: without an effect that never acted **not a bit** of the
    answer differs. Switch off fracture, slip, contact and friction: the change stays zero.

    Pull with 2 m/s and switch off the contact. What do you see, what does the program say? :: The
    pieces pass through each other when the bar is pressed together. The run ends without a word of
    error: **every figure looks fine**. Only the last row tells: bodies overlap, *list it*. A
    program that stays silent here would be dangerous.

    Switch off fracture. Why is contact then never missed? :: Nothing breaks, so nothing comes loose
    that could touch. Effects hang together: ask for one, and others follow.

    A hard pull makes the program warn of sphere dashpots. How wrong is it? :: By 0.2 %: so far do
    the bodies end elsewhere when the step is halved, and the warning stays. Twice as long a step
    would be wrong by 2 %. A warning is a reason to try a shorter step, and not yet an error.

    Which effect is dear, and is it the one that matters most? :: Leave out one at a time and press
    the button. Dear and important are two things: look at the share of the energy in the table, and
    at where the bodies end.

    Fracture takes 2 % of the energy. Can it go? :: No. It *steers*: it takes little and decides
    where everything goes. The program never drops such an effect because its energy is small, only
    because it never acted.
    """
    questions(mo, _text)
    return


if __name__ == "__main__":
    app.run()
