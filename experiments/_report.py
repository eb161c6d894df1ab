"""What blast experiments share: defaults by size of the job, tables, and the end of a run."""

import os
import textwrap

from _cli import figure, print_figures, print_table, write_summary
from taichi_dem.kit.files import write_csv, write_text


def take_defaults(options, full, quick):
    """Give options that are not set the value of the full or of the quick job."""
    for name, value in (quick if options.quick else full).items():
        if getattr(options, name, None) is None:
            setattr(options, name, value)


def columns_of(rows):
    """Rows, dicts with the same keys, as columns."""
    return {name: [row[name] for row in rows] for name in rows[0]}


def write_rows(folder, name, rows):
    """Write rows as a CSV file."""
    write_csv(os.path.join(folder, name), columns_of(rows))


def show_rows(rows, formats):
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


def figures_from(row, units, name="{}"):
    """Figures of summary.json from a row; units: by key. name: of a figure, by the key."""
    return {name.format(key): figure(row[key], unit) for key, unit in units.items()}


def finish(options, name, figures, reports, caption="", see="", seconds=None):
    """Write summary.json, and caption.txt where there is a caption; print both.

    reports: of all runs. see: the picture to look at first. seconds: of compiling and of running,
    instead of those of the reports.
    """
    compiling, running = seconds or (
        sum(one.compile_seconds for one in reports),
        sum(one.run_seconds for one in reports),
    )
    write_summary(options.out, name, figures, compile_seconds=compiling, run_seconds=running)
    print_figures(figures)
    if caption:
        write_text(os.path.join(options.out, "caption.txt"), caption + "\n")
        print("\n" + textwrap.fill(caption, 100))
    see = f": see {see} first" if see else ""
    print(f"\nPictures and tables are in {options.out}{see}")
