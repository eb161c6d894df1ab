"""Tables of a study: printed, and written as CSV."""

from collections.abc import Mapping, Sequence
from typing import Any

from taichi_dem.kit.files import write_csv
from taichi_dem.kit.terminal import print_table


def columns_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, list]:
    """Rows, dicts with the same keys, as columns."""
    return {name: [row[name] for row in rows] for name in rows[0]}


def write_rows(path: str, rows: Sequence, names: str | Sequence[str] | None = None) -> None:
    """Write rows as CSV.

    rows: dicts with the same keys, or cells under names of columns, a sequence or words.
    """
    if names is None:
        write_csv(path, columns_of(rows))
        return
    names = names.split() if isinstance(names, str) else names
    columns: list[Any] = list(zip(*rows)) or [()] * len(names)
    write_csv(path, dict(zip(names, columns)))


def show_rows(rows: Sequence[Mapping[str, Any]], formats: Mapping[str, tuple[str, str]]) -> None:
    """Print rows; formats: header -> (key, format of the value as in an f-string).

    A format that ends with % is of a share in percent.
    """
    print_table(
        [[_cell(row[key], form) for key, form in formats.values()] for row in rows], [*formats]
    )
    print()


def _cell(value, form):
    if value is None:
        return ""
    if form.endswith("%"):
        return f"{100.0 * value:{form[:-1]}} %"
    return format(value, form)
