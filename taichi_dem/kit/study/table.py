"""A table of a study, declared once: computed, printed, and given as figures of summary.json."""

from collections.abc import Callable, Iterable, Mapping
from operator import attrgetter
from typing import Any, NamedTuple

from taichi_dem.kit.study.summary import figure
from taichi_dem.kit.study.tables import show_rows

#: A row by key.
Row = dict[str, Any]


class Column(NamedTuple):
    """A column: value, header and format of the printed table, unit of the figure.

    value: dotted name of an attribute of the subject of a row, place in a subject that is a tuple,
    or a function of it. A column without a header is not printed, one without a unit is no figure.
    format: as of ``show_rows``.
    """

    value: str | int | Callable[[Any], Any]
    header: str = ""
    format: str = ""
    unit: str = ""

    def of(self, subject: Any) -> Any:
        """Value for the subject of a row."""
        value = self.value
        if isinstance(value, int):
            return subject[value]
        return attrgetter(value)(subject) if isinstance(value, str) else value(subject)


class Table:
    """Columns by key, each the arguments of a ``Column``."""

    def __init__(self, **columns: tuple):
        self.columns = {key: Column(*given) for key, given in columns.items()}

    def rows(self, subjects: Iterable) -> list[Row]:
        """A row for each subject, a dict that ``write_rows`` takes too."""
        columns = self.columns.items()
        return [{key: column.of(subject) for key, column in columns} for subject in subjects]

    def show(self, rows: Iterable[Row]) -> None:
        """Print the columns that have a header."""
        shown = [(key, one) for key, one in self.columns.items() if one.header]
        show_rows([*rows], {one.header: (key, one.format) for key, one in shown})

    def figures(
        self, row: Row, name: str = "{key}", paper: Mapping[str, Any] = {}
    ) -> dict[str, dict]:
        """Figures of a row, of the columns that have a unit.

        name: of a figure, with {key} and any other key of the row in braces. paper: by key.
        """
        units = {key: one.unit for key, one in self.columns.items() if one.unit}
        return {
            name.format(key=key, **row): figure(row[key], unit, paper.get(key))
            for key, unit in units.items()
        }
