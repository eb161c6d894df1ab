"""Picture of the effects' costs: a cost whose interval holds zero."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from taichi_dem.kit.plot_style import BLUE, SKY, styled


def effect(cost, least, most, sign=1.0):
    costs = {"spared_percent": cost, "spared_least_percent": least, "spared_most_percent": most}
    return "some_effect", {name: sign * value for name, value in costs.items()}, sign


EFFECTS = [
    effect(-0.04, -1.2, 0.6),
    effect(24.0, 17.0, 33.0),
    effect(-20.0, -30.0, -8.0),
    effect(14.0, 7.0, 21.0, sign=-1.0),
]


@pytest.fixture
def axes(script):
    with styled() as (_, made):
        script("_effects_pictures").draw_costs(made, EFFECTS)
        yield made


def test_a_cost_whose_interval_holds_zero_is_pale_and_says_so(axes):
    words = [text.get_text().strip() for text in axes.texts]
    assert words == ["0.0 %, not resolved", "24 %", "−20 %", "14 %"]
    colours = [to_hex(bar.get_facecolor()).lower() for bar in axes.patches]
    assert colours == [colour.lower() for colour in (SKY, BLUE, BLUE, BLUE)]


def test_no_number_is_changed_and_the_interval_is_drawn(axes):
    assert [bar.get_width() for bar in axes.patches] == [-0.04, 24.0, -20.0, 14.0]
    drawn = [tuple(line.get_xdata()) for line in axes.lines[:4]]
    assert np.allclose(drawn, [(-1.2, 0.6), (17.0, 33.0), (-30.0, -8.0), (7.0, 21.0)])
    assert axes.get_yticklabels()[3].get_text() == "some effect\n(added)"


@pytest.mark.parametrize("name", ["friction of spheres", "static contact", "softening"])
def test_a_negative_price_is_told_with_its_reason_or_without(script, name):
    """Which effects have one is known only once they are measured."""
    row = dict(zip(("spared_percent", "spared_least_percent", "spared_most_percent"), (-3, -4, -2)))
    tables = script("_effects_tables")
    words = tables.why_dearer(name, row, row, 1.0)
    assert words.startswith(f"{name}: a step without it takes more, 3.0 % (2.0 to 4.0)")
    assert words.endswith(tables.WHY.get(name, "(2.0 to 4.0)"))
