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
    from _page import ask, guesses, questions, replies, sliders, tell

    mo.md("""
    # Which effects does my scene need?

    A bar is held on the left. Its right end is pulled out and a little down, and then pressed back
    in. Switch effects off: what is not listed is not computed, not stored, not compiled. A good
    scene lists what it needs, and nothing else.
    """)
    return ask, guesses, lesson, mo, questions, replies, sliders, tell


@app.cell
def _(lesson, mo, sliders):
    listed = mo.ui.dictionary(
        {name: mo.ui.switch(value=True, label=words) for name, (_, words) in lesson.EFFECTS.items()}
    )
    chosen = sliders(mo, {"speed": (lesson.SPEEDS, 2.0, "the right end starts with [m/s]")})
    measure = mo.ui.run_button(label="measure what this choice costs (compiles it first)")
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
def _(guesses, mo, questions):
    asked = questions("""
    Pull gently, with 0.2 m/s. How many of the five effects change no bit of the answer? :: none |
    one | *four | five :: All but the dashpots. The table says *never acted*: without an effect that
    never acted **not a bit** differs. Switch off fracture, slip, contact and friction: the change
    stays zero.

    Pull with 2 m/s and switch off the contact. What does the program say? :: it ends the run with
    an error | *only the table says that bodies overlap | it warns that energy comes from nowhere ::
    The pieces pass through each other when the bar is pressed together: **every figure looks
    fine**. Only the table says *list it*. A program that stays silent here would be dangerous.

    Switch off fracture and contact. Does the program miss the contact? :: *no | yes, as without
    contact alone | yes: bodies pass through each other :: Nothing breaks, so nothing comes loose
    that could touch. Effects hang together: ask for one, and others follow.

    Take half the time step. How far elsewhere do bodies end, at 2 m/s? :: *by 0.02 % | by 2 % |
    by as much as without friction :: A step of 0.4 µs is twenty times as long as dashpots would
    allow, but they are solved, not stepped. The step is not what to worry about here: friction that
    is missing makes over a thousand times that difference, and no shorter step brings it back.

    Friction costs less of a step than can be measured. How far elsewhere do bodies end without
    it, at 2 m/s? :: by too little to be measured | by about 10 % | *by about 50 % :: Cost and use
    are two things: dashpots cost a third of a step and contact a quarter, and without them bodies
    end 41 and 139 % elsewhere; without slip they end 0.07 % elsewhere. Leave out one at a time and
    press the button.

    Fracture takes 2 % of the energy. Can it go? :: *no | yes | only if 2 % of error will do :: It
    *steers*: it takes little and decides where everything goes. The program never drops such an
    effect because its energy is small, only because it never acted.
    """)
    guessed = guesses(mo, asked)
    return asked, guessed


@app.cell
def _(asked, guessed, mo, replies):
    replies(mo, asked, guessed)
    return


if __name__ == "__main__":
    app.run()
