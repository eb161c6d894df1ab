"""Tools of a study: options, tables, figures of a summary, timings, kept results, workers."""

from taichi_dem.kit.provenance import processor
from taichi_dem.kit.study.accuracy_option import (
    add_accuracy,
    check_accuracy,
    show_answer,
    write_accuracy,
)
from taichi_dem.kit.study.answers import cheapest_figures, figures_by_method, give_answers
from taichi_dem.kit.study.cached_result import cached, digest
from taichi_dem.kit.study.command_line import (
    Parser,
    add_checkpoints,
    add_pictures,
    bare_parser,
    checkpoint_of,
    exit_code,
    interval,
    main,
    main_of_tool,
    number,
    one_of,
    output_paths,
    parser,
    several,
    tolerance,
    whole,
)
from taichi_dem.kit.study.look import print_figures, value_in_words
from taichi_dem.kit.study.new_process import call_in_process, call_rounds
from taichi_dem.kit.study.settings import add_settings, begin, take_settings
from taichi_dem.kit.study.summary import (
    figure,
    finish,
    versions,
    write_summary,
)
from taichi_dem.kit.study.table import Table
from taichi_dem.kit.study.tables import columns_of, show_rows, write_rows
from taichi_dem.kit.study.timing import Timing, clock, on_device, seconds_of
from taichi_dem.kit.terminal import print_table

__all__ = [
    "Parser",
    "Table",
    "Timing",
    "add_accuracy",
    "add_checkpoints",
    "add_pictures",
    "add_settings",
    "bare_parser",
    "begin",
    "cached",
    "call_in_process",
    "call_rounds",
    "cheapest_figures",
    "check_accuracy",
    "checkpoint_of",
    "clock",
    "columns_of",
    "digest",
    "exit_code",
    "figure",
    "figures_by_method",
    "finish",
    "give_answers",
    "interval",
    "main",
    "main_of_tool",
    "number",
    "on_device",
    "one_of",
    "output_paths",
    "parser",
    "print_figures",
    "print_table",
    "processor",
    "seconds_of",
    "several",
    "show_answer",
    "show_rows",
    "take_settings",
    "tolerance",
    "value_in_words",
    "versions",
    "whole",
    "write_accuracy",
    "write_rows",
    "write_summary",
]
