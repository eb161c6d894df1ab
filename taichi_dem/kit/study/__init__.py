"""Tools of a study: options, tables, figures of a summary, timings, processes."""

from taichi_dem.kit.children import call_in_process
from taichi_dem.kit.provenance import processor
from taichi_dem.kit.study.program import (
    Parser,
    accuracy_sources,
    add_accuracy,
    add_checkpoints,
    add_out,
    add_pictures,
    bare_parser,
    begin,
    check_accuracy,
    checkpoint_of,
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
from taichi_dem.kit.study.summary import (
    Table,
    add_to_summary,
    figure,
    finish,
    markdown_of,
    show_answer,
    show_report,
    versions,
    write_accuracy,
    write_rows,
)
from taichi_dem.kit.terminal import print_table
from taichi_dem.kit.timing import clock, on_device, seconds_of
