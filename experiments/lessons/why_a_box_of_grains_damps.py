"""Lesson: why does a box of grains damp? Read, guess, move a slider, see.

make lessons                                             # in the browser, with sliders
python experiments/lessons/why_a_box_of_grains_damps.py  # the first answer, without one
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Why does a box of grains damp?")


@app.cell
def _():
    import marimo as mo

    import _grains as lesson
    from _page import ask, guesses, percent, questions, replies, sliders, tell

    mo.md("""
    # Why does a box of grains damp?

    A box hangs on a spring. Its base shakes it up and down. In the box lie loose grains, which
    the floor throws and catches.

    Nothing in the box is sticky, and still the box swings less. Where does the energy go, and
    when?
    """)
    return ask, guesses, lesson, mo, percent, questions, replies, sliders, tell


@app.cell
def _(lesson, mo, sliders):
    chosen = sliders(mo, lesson.CHOICES)
    _base, _ratio, _grains, _share = chosen.elements.values()
    mo.hstack([mo.vstack([_base, _ratio]), mo.vstack([_grains, _share])], justify="start", gap=3)
    return (chosen,)


@app.cell
def _(ask, chosen, lesson, mo, percent, tell):
    _base, _ratio, _grains, _share = chosen.value.values()
    _choice = _grains, 0.01 * _share, 1e-3 * _base, _ratio
    _answer, _picture = ask(mo, "Shaking twelve boxes.", lesson, lesson.Answer, *_choice)
    _taken, _swing = _answer.energy["filling"] / _answer.energy["base"], _answer.swing
    _words = (
        f"The box swings by **{1e3 * _swing:.2g} mm** and is accelerated by up to "
        f"**{_answer.throw:.2g} g**. The grains take **{percent(max(0.0, _taken))}** of the energy "
        f"that the base gives; the damping ratio is {_answer.damping_ratio:.2g} instead of "
        f"{_answer.oscillator.damping_ratio:.2g}."
    )
    tell(mo, _picture, "Response, energy a cycle, box", _words)
    return


@app.cell
def _(guesses, mo, questions):
    asked = questions("""
    Make the base's motion small. What do the grains do? :: *they lie still and take nothing | they
    damp as before | they bounce a little and take a little :: The curve is that of **grains glued
    to the floor**. It peaks lower in frequency, as more mass hangs on the same spring.

    From which swing on do the grains fly? :: 0.7 mm | *7 mm | 70 mm | from any :: When the floor
    falls away faster than they do: acceleration above **g**. At 6 Hz that is g / ω² = 10 / (2π 6)²
    = 7 mm. Look for 1 g in the sentence below the picture: from there on the grains take their
    share.

    Where does the energy go? :: into lifting the grains | *into blows | into friction at the walls
    :: A grain that lands meets the floor at some speed, and goes on with three quarters of it, that
    is with 56 % of the energy. The rest warms the grains. The three bars add up: what the base
    gives is what dashpot and grains take. (Ten grains or fewer keep no steady beat: there the sum
    is off.)

    Go from 4 to 20 % of mass. By how much does the peak fall? :: by half | by four fifths | *by a
    seventh :: From 9.5 to 8 mm only. The damping **limits itself**. As soon as the box comes near 1
    g the grains stay down and take nothing. Look at the acceleration: it stays above 1.3 g.

    Ten grains, or sixty of the same mass together: which damps better? :: ten, by heavier blows |
    *both about alike | sixty, by more blows :: 8.7 and 8.6 mm at the peak. What counts is the
    **mass that is thrown and caught** and that it has way to fly. Few grains do it less evenly:
    look how bumpy the curve gets with five.

    Is there one number that says how strongly the grains damp? :: *no | a damping ratio | their
    coefficient of restitution :: A dashpot has one damping ratio at any swing. Here it is 0.012
    below 1 g, that of the empty box, 0.023 at 0.6 mm and 0.033 at 1 mm of the base, each at the
    peak. The damper is **not linear**.
    """)
    guessed = guesses(mo, asked)
    return asked, guessed


@app.cell
def _(asked, guessed, mo, replies):
    replies(mo, asked, guessed)
    return


if __name__ == "__main__":
    app.run()
