"""Lesson: why does a box of grains damp?

    make lessons                                             # in the browser, with sliders
    python experiments/lessons/why_a_box_of_grains_damps.py  # the first answer, without one

The class reads a question, moves a slider, sees, and then unfolds the answer.
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Why does a box of grains damp?")


@app.cell
def _():
    import marimo as mo

    import _grains as lesson
    from _engine import engine
    from _pictures import percent, picture_grains

    served = mo.app_meta().mode in ("run", "edit")
    return engine, lesson, mo, percent, picture_grains, served


@app.cell
def _(mo):
    mo.md("""
    # Why does a box of grains damp?

    A box hangs on a spring. Its base shakes it up and down. In the box lie loose grains, which
    the floor throws and catches.

    Nothing in the box is sticky, and still the box swings less. Where does the energy go, and
    when?
    """)
    return


@app.cell
def _(lesson, mo):
    _look = {"show_value": True, "debounce": True}
    base = mo.ui.slider(
        steps=[0.05, 0.1, 0.2, 0.4, 0.6, 1.0, 1.5, 2.0],
        value=1e3 * lesson.FIRST["base"],
        label="base moves by [mm]",
        **_look,
    )
    grains = mo.ui.slider(
        steps=[5, 10, 20, 30, 40, 60],
        value=lesson.FIRST["grains"],
        label="grains (160 fill the box)",
        **_look,
    )
    share = mo.ui.slider(
        steps=[2, 4, 7, 10, 15, 20],
        value=round(100 * lesson.FIRST["share"]),
        label="their mass [% of the box's]",
        **_look,
    )
    ratio = mo.ui.slider(
        steps=list(lesson.RATIOS),
        value=lesson.FIRST["ratio"],
        label="frequency / own frequency",
        **_look,
    )
    mo.hstack([mo.vstack([base, ratio]), mo.vstack([grains, share])], justify="start", gap=3)
    return base, grains, ratio, share


@app.cell
def _(base, engine, grains, lesson, mo, percent, picture_grains, ratio, served, share):
    with mo.status.spinner("Shaking twelve boxes. The first time they are compiled, some seconds."):
        _answer = engine.ask(
            lesson.answer, grains.value, 0.01 * share.value, 1e-3 * base.value, ratio.value
        )
        _picture = engine.ask(picture_grains, _answer)
    _taken = _answer.energy["grains"] / _answer.energy["base"]
    _empty = _answer.oscillator.damping_ratio
    _words = (
        f"The box swings by **{1e3 * _answer.amplitude:.2g} mm** and is accelerated by up to "
        f"**{_answer.throw:.2g} g**. The grains take **{percent(max(0.0, _taken))}** of the energy "
        f"that the base gives; the damping ratio is {_answer.damping_ratio:.2g} instead of "
        f"{_empty:.2g}."
    )
    if not served:
        print(_words)
    mo.vstack([mo.image(_picture, alt="Response, energy a cycle, box"), mo.md(_words)])
    return


@app.cell
def _(mo):
    mo.accordion(
        {
            "Make the base's motion small. What do the grains do, and what do they take?": mo.md(
                "They lie still and take nothing: the curve is that of **grains glued to the "
                "floor**. It peaks lower in frequency, as more mass hangs on the same spring."
            ),
            "From which swing on do the grains fly?": mo.md(
                "When the floor falls away faster than they do: acceleration above **g**. At 6 Hz "
                "that is g / ω² = 9.8 / (2π 6)² = **7 mm**. Look for 1 g in the sentence below the "
                "picture: from there on the grains take their share."
            ),
            "Where does the energy go?": mo.md(
                "Into **blows**. A grain that lands meets the floor at some speed, and goes on "
                "with three quarters of it, that is with 56 % of the energy. The rest warms the "
                "grains. The three bars add up: what the base gives is what dashpot and grains "
                "take. (Ten grains or fewer keep no steady beat: there the sum is off.)"
            ),
            "Does twice the mass of grains halve the swing?": mo.md(
                "Far from it: from 4 to 20 % of the mass the peak falls from 9.5 to 8 mm. The "
                "damping **limits itself**. As soon as the box comes near 1 g the grains stay down "
                "and take nothing. Look at the acceleration: it stays above 1.3 g."
            ),
            "Ten grains, or sixty of the same mass together: which damps better?": mo.md(
                "About alike: 8.7 and 8.6 mm at the peak. What counts is the **mass that is thrown "
                "and caught** and that it has way to fly. Few grains do it less evenly: look how "
                "bumpy the curve gets with five."
            ),
            "Is there one number that says how strongly the grains damp?": mo.md(
                "No. A dashpot has one damping ratio at any swing. Here it is 0.012 below 1 g, "
                "that of the empty box, 0.024 at 0.6 mm and 0.033 at 1 mm of the base, each at the "
                "peak. The damper is **not linear**."
            ),
        }
    )
    return


if __name__ == "__main__":
    app.run()
