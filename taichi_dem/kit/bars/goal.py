"""What both kinds of goal have in common."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import choice, shown, word


@dataclass(frozen=True)
class BaseGoal:
    """Name, unit, function and kind of an output."""

    kinds: ClassVar[tuple[str, ...]]
    given: ClassVar[str]

    name: str
    unit: str
    function: Callable[[Any], Any] = field(repr=False)
    kind: str = "value"

    def __post_init__(self) -> None:
        word("name of a goal", self.name)
        word("unit of a goal", self.unit)
        choice("kind of a goal", self.kind, self.kinds)
        if not callable(self.function):
            raise InputError(
                f"function of a goal must be a function of a {self.given}, "
                f"got {shown(self.function)}"
            )
