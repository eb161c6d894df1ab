"""Pictures of the damper; the only part of the package that imports matplotlib."""

from ca_damper.plot.boxes import (
    Box,
    DrawnBox,
    Hanging,
    animate_films,
    film_hanging,
    frame_panel,
    picture_film_strips,
)
from ca_damper.plot.curves import (
    FilmMeasures,
    picture_compared,
    picture_cycle,
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
    "picture_compared",
    "picture_cycle",
    "picture_film_strips",
    "picture_hysteresis",
    "picture_measures",
    "picture_responses",
]
