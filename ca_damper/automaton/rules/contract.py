"""What a rule set of the automaton is: options of a user, and what they decide."""

from abc import ABC, abstractmethod
from collections.abc import Hashable
from typing import ClassVar

from ca_damper.automaton.device import LatticeDevice
from ca_damper.report.certificate import CheckedRange, Driven


class Rules(ABC):
    """Base of all rule sets: frozen dataclasses of options, checked when they are made."""

    #: What carries out the rules, made with an Automaton and the SceneFields of an engine.
    device: ClassVar[type[LatticeDevice]]
    #: Whether walls and particles move by whole cells, which needs gravity along the columns.
    by_cells: ClassVar[bool] = False

    @property
    @abstractmethod
    def label(self) -> str:
        """Short word for tables and files."""

    @property
    @abstractmethod
    def effects(self) -> tuple[str, ...]:
        """Effects that are computed, in words for the report."""

    @property
    def order(self) -> int | None:
        """Order of the error in the step; None where not all impulses count."""
        return 1

    @property
    def numbers(self) -> dict[str, float]:
        """Options that kernels read as ``self.parameters.NAME[s]``, by name."""
        return {}

    @property
    def compiled(self) -> Hashable:
        """The class, and all options but the numbers: what decides on the compiled kernels."""
        numbers = self.numbers
        return type(self), *(value for name, value in vars(self).items() if name not in numbers)

    @abstractmethod
    def known_range(self, automaton: object, driven: Driven) -> CheckedRange:
        """The range in which the rules were checked, and what of the scenes lies outside it."""

    def range_of(self, automaton: object, driven: Driven) -> CheckedRange:
        """Their own ``known_range``; a class that takes another's was compared with nothing."""
        if "known_range" in vars(type(self)):
            return self.known_range(automaton, driven)
        return CheckedRange("none is known", (f"rules {type(self).__name__}",))
