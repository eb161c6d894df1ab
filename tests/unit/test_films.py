"""Images of a film, of which only changes are drawn, are those of figures drawn as a whole."""

import itertools

import numpy as np

from taichi_dem.kit import plot_style


def images_of_a_film():
    """A dot under a line and a legend, a title, a text that comes late, limits that change last."""
    with plot_style.filming((3.0, 2.0), 60, plot_style.STYLE) as (figure, shoot, images):
        left, right = figure.subplots(1, 2)
        (dot,) = left.plot([0.0], [0.0], "o", ms=20, label="dot")
        left.plot([0.0, 4.0], [0.0, 1.0], label="line", alpha=0.5)
        left.legend(loc="center")
        (late,) = right.plot([], [], "s")
        right.set_axis_off()
        footer = figure.supxlabel(" ")
        for number in range(5):
            dot.set_data([number], [0.2 * number])
            left.set_title(f"image {number}")
            if number > 1:
                late.set_data([0.1 * number], [0.5])
                footer.set_text(f"since {number}")
            if number > 2:
                left.set_xlim(-number, 5.0)
            shoot()
    return [np.asarray(image) for image in images]


def test_drawing_only_what_changes_leaves_the_same_pixels(monkeypatch):
    made = images_of_a_film()
    monkeypatch.setattr(plot_style, "_draw_changes", lambda canvas, _: canvas.draw())
    whole = images_of_a_film()
    assert all(np.array_equal(one, other) for one, other in zip(made, whole))
    assert all((one != other).any() for one, other in itertools.pairwise(made))
