"""Pictures of the damper; the only part of the package that imports matplotlib."""

from ca_damper.plot.animation import moving_picture
from ca_damper.plot.box import Box, DrawnBox, frame_panel
from ca_damper.plot.cycle import FilmMeasures, picture_cycle
from ca_damper.plot.film_strip import animate_films, picture_film_strips
from ca_damper.plot.hanging import Hanging, film_hanging
from ca_damper.plot.response import (
    picture_compared,
    picture_hysteresis,
    picture_measures,
    picture_responses,
)

__all__ = [
    "Box",
    "DrawnBox",
    "FilmMeasures",
    "Hanging",
    "animate_films",
    "film_hanging",
    "frame_panel",
    "moving_picture",
    "picture_compared",
    "picture_cycle",
    "picture_film_strips",
    "picture_hysteresis",
    "picture_measures",
    "picture_responses",
]
