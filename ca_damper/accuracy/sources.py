"""The model of the grains as a source of error, which seeds and steps do not show."""

import math
from typing import Any

import numpy as np

from ca_damper.automaton import Automaton
from ca_damper.spheres import Spheres
from taichi_dem.kit.bars.answer import Answer
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.errors import InputError

#: Sources that ``solve_response`` measures when asked; step and chance always are.
MEASURED = ("step", "filling")
#: Share of a place that a box may lack, by rounding.
_WHOLE = 1e-9
#: What grains of both kinds have.
_SHARED = ("restitution", "wall_restitution", "particle_mass", "gravity")


def other_filling(filling: Any) -> Any:
    """Spheres in the box of an automaton, or the places in which spheres lie; None for others."""
    try:
        return _other_kind(filling)
    except InputError:
        return None


def _other_kind(filling):
    if isinstance(filling, Automaton):
        size = filling.width
        box: dict[str, Any] = {"width": filling.columns * size, "height": filling.rows * size}
        return Spheres(diameter=size, **box, **_shared(filling))
    if isinstance(filling, Spheres) and filling.sizes is None:
        size = filling.diameter
        columns, rows = (math.floor(x / size + _WHOLE) for x in (filling.width, filling.height))
        places: dict[str, Any] = {"columns": columns, "rows": rows}
        return Automaton(width=size, **places, **_shared(filling))
    return None


def _shared(filling) -> dict[str, Any]:
    return {name: getattr(filling, name) for name in _SHARED}


def filling_source(answer: Answer, filling: Any, other: Answer | str | None) -> Source | None:
    """The filling as a source of an answer; None where it has no grains."""
    if not isinstance(filling, (Automaton, Spheres)):
        return None
    kind = other_filling(filling)
    if kind is None:
        return Source("filling", math.nan, "not measured: there is no other model of these grains")
    name = type(kind).__name__
    if isinstance(other, Answer):
        apart: Any = np.hypot(np.abs(answer.value - other.value), other.error)
        words = f"the same question to {name}(), with its bar"
        return Source("filling", apart, words, other.plan.seconds)
    words = other or f"run {name}()"
    return Source("filling", math.nan, f"not measured: {words}", answer.plan.seconds)
