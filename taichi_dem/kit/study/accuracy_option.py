"""The option --accuracy of a study: answers with error bars, printed and written as CSV."""

import os
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Sequence
from typing import Any

from taichi_dem.kit.bars.answer import Answer
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.study.command_line import tolerance
from taichi_dem.kit.study.tables import write_rows

#: Columns of accuracy.csv behind those that name the answer.
COLUMNS = ("goal", "unit", "value", "error", "seconds", "reached")


def add_accuracy(made: ArgumentParser, what: str) -> None:
    """Add the option; what: is found to that share of its value, in words."""
    words = f"find {what} to this share of their value, such as 1%%, and nothing else"
    made.add_argument("--accuracy", type=tolerance, default=None, help=words)


def check_accuracy(options: Namespace, others: Iterable[str] = ()) -> None:
    """Raise InputError where --accuracy was given with what leaves it no choice.

    others: options beside those of checkpoints, by name.
    """
    given = [name for name in ("resume", "checkpoint_every", *others) if getattr(options, name)]
    if given:
        names = " and ".join(name.replace("_", "-") for name in given)
        raise InputError(f"accuracy must be left out with {names}: it chooses runs of its own")


def show_answer(label: str, answer: Answer) -> None:
    """Print an answer, whether it was reached, and what other tolerances cost; label: of what."""
    print(f"{label}, {answer.goal}: {answer}")
    asked = f"{100.0 * answer.tolerance:g} %"
    print(f"  {asked} {'was' if answer.reached else 'was not'} reached")
    for expense in answer.cost_curve:
        print(f"  {expense}")


def write_accuracy(
    folder: str, names: Sequence[str], rows: Iterable[tuple[Sequence[Any], Answer]]
) -> None:
    """Write accuracy.csv; rows: cells under these names, and the answer that they belong to."""
    cells = []
    for first, answer in rows:
        own = answer.value, answer.error, answer.plan.seconds, answer.reached
        cells.append((*first, answer.goal, answer.unit, *own))
    write_rows(os.path.join(folder, "accuracy.csv"), cells, [*names, *COLUMNS])
