"""Values by which bodies are coloured, by name."""

from typing import Any

import numpy as np

from taichi_dem.kit.validation import choice
from taichi_dem.output.fragments import fragment_of_body
from taichi_dem.output.record import Frame

#: Multiples of the golden ratio, less whole numbers, lie far apart.
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
#: Unit and words of what bodies can be coloured by.
COLOURS = {
    "speed": ("m/s", "speed"),
    "peak_speed": ("m/s", "largest speed so far"),
    "displacement": ("m", "displacement"),
    "damage": ("1", "damage"),
    "level": ("1", "level of the step"),
    "fragment": ("1", "fragment, by falling mass"),
}


def body_values(result: Any, frame: Frame, colour: str) -> np.ndarray:
    """Value of every body of a ``Result`` in a frame, (body_count,); colour: one of COLOURS."""
    if choice("colour", colour, COLOURS) == "fragment":
        return fragment_of_body(result.model, result.broken_time <= frame.time_s)
    if colour == "peak_speed":
        return result.peak_speed
    if colour == "displacement":
        return np.linalg.norm(frame.displacement, axis=1)
    return getattr(frame, colour)


def scale_end(values: np.ndarray) -> float:
    """Value that a fiftieth of the bodies exceed, or the largest where that is 0."""
    return float(np.percentile(values, 98.0) or values.max())


def shares_of_scale(result: Any, frame: Frame, colour: str) -> np.ndarray:
    """Values of bodies as shares of a scale from 0 to 1, (body_count,).

    1 is what a fiftieth of the bodies exceed. Fragments are spread over the scale, so that
    neighbours differ.
    """
    values = body_values(result, frame, colour)
    if colour == "fragment":
        return values * _GOLDEN % 1.0
    top = scale_end(values)
    return np.clip(values / top, 0.0, 1.0) if top > 0.0 else np.zeros(len(values))
