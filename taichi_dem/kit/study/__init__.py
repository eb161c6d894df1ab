"""Tools of a study: options, tables, figures of a summary, timings, kept results, workers."""

from taichi_dem.kit.provenance import processor
from taichi_dem.kit.study.cached_result import cached, digest
from taichi_dem.kit.study.new_process import call_in_process, call_rounds
from taichi_dem.kit.study.program import (
    Parser,
    add_accuracy,
    add_checkpoints,
    add_pictures,
    add_settings,
    bare_parser,
    begin,
    check_accuracy,
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
    take_settings,
    tolerance,
    whole,
)
from taichi_dem.kit.study.summary import (
    add_to_summary,
    figure,
    finish,
    print_figures,
    show_answer,
    value_in_words,
    versions,
    write_accuracy,
)
from taichi_dem.kit.study.tables import Table, columns_of, show_rows, write_rows
from taichi_dem.kit.study.work_precision import cheapest_figures, figures_by_method, give_answers
from taichi_dem.kit.terminal import print_table
from taichi_dem.kit.timing import Timing, clock, on_device, seconds_of
