"""What ``tests.figures`` finds in a figure, and figures drawn of made-up numbers."""

import pytest

from _hard_cases import registry
from taichi_dem.kit.plot_style import RED, STYLES, power, styled, styles_of
from taichi_dem.kit.study.cases_picture import case_title, with_powers
from tests.figures import bad_words_in, defects


def of(draw):
    """Defects of a figure with one pair of axes, labelled with units, that a function changes."""
    with styled() as (figure, axes):
        axes.set(xlabel="time [s]", ylabel="displacement [mm]")
        axes.plot([0.0, 1.0], [0.0, 1.0])
        draw(axes)
        figure.canvas.draw()
        return defects(figure)


def legend_of(label, **look):
    def draw(axes):
        axes.plot([0.0, 1.0], [1.0, 0.0], label=label, **look)
        axes.legend()

    return draw


FAULTS = {
    "code": lambda axes: axes.set_title("multirate_held"),
    "code of a tick": lambda axes: axes.set_yticks([0.0], ["ca_static"]),
    "code in a legend": legend_of("paper_uniform"),
    "number": lambda axes: axes.set_title("a step of 1e-07 s"),
    "unit": lambda axes: axes.set_xlabel("time"),
    "no label": lambda axes: axes.set_ylabel(""),
    "colour": legend_of("one fixed step, solved dashpots", color=RED),
    "colour of a part": legend_of("struck end, paper's rule, multirate", color=RED),
    "dotted": lambda axes: axes.axhline(0.5, ls=":"),
    "dashed": lambda axes: axes.axvline(0.5, ls="--"),
    "band": lambda axes: axes.fill_between([0.0, 1.0], 0.0, 1.0, alpha=0.2),
    "stripe": lambda axes: axes.axhspan(0.0, 0.5, color="0.9"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_figure_that_leaves_something_unsaid_is_found(fault):
    assert len(of(FAULTS[fault])) == 1


GOOD = {
    "mathematics": lambda axes: axes.set_title("f / f$_0$"),
    "words": lambda axes: axes.set(ylabel="", yticks=[0.0, 1.0], yticklabels=["this", "that"]),
    "quoted": lambda axes: axes.set_title("“v_max is 1e-07 m/s”"),
    "colour": legend_of("spheres, all pairs", color=STYLES["dem"].colour),
    "dotted": legend_of("bound", ls=":"),
    "nothing shown": lambda axes: axes.set_axis_off(),
    "no ticks": lambda axes: axes.set(ylabel="", yticks=[]),
}


@pytest.mark.parametrize("good", GOOD)
def test_figure_that_says_what_it_shows_passes(good):
    assert of(GOOD[good]) == []


def test_names_of_a_method_share_its_style_and_others_take_free_colours():
    made = styles_of(["paper_uniform", "uniform", "dem_tsuji", "spheres", "mine", "yours"])
    assert made["paper_uniform"] is made["uniform"]
    assert made["dem_tsuji"] is made["spheres"]
    assert made["mine"].label == "mine"
    assert len({style.colour for style in made.values()}) == 3


def test_methods_of_a_package_differ_in_colour():
    names = list(STYLES)
    blast, damper = names[: names.index("ca_static")], names[names.index("ca_static") :]
    for own in (blast, damper):
        assert len({STYLES[name].colour for name in own}) == len(own)
    assert len({style.label for style in STYLES.values()}) == len(names)


@pytest.mark.parametrize(
    ("value", "words"),
    [(1e-6, "10⁻⁶"), (3.14e-7, "3.1 × 10⁻⁷"), (2e4, "2 × 10⁴"), (9.96e3, "10⁴"), (1.0, "10⁰")],
)
def test_power_has_two_figures(value, words):
    assert power(value) == words


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("fragment_at_1_km_s", "fragment at 1 km/s"),
        ("coordinates_at_1_km", "coordinates at 1 km"),
        ("wall_at_30_m_slides", "wall at 30 m slides"),
        ("mass_ratio_1e4", "mass ratio 10⁴"),
        ("full_box", "full box"),
    ],
)
def test_case_is_told_in_words(name, words):
    assert case_title(name) == words


@pytest.mark.parametrize("case", registry(), ids=lambda case: case.name)
def test_names_and_questions_of_hard_cases_are_words(case):
    assert not list(bad_words_in((case_title(case.name), with_powers(case.question))))
