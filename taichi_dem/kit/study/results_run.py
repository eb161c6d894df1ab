"""Studies run one after the other, each in a process of its own, and how each ended."""

import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from taichi_dem.kit import children
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.study.results_page import CAPTION, RUN, Entry


def run_entries(
    scripts: str | Path,
    entries: Sequence[Entry],
    root: str,
    *,
    quick: bool = False,
    reuse: bool = False,
) -> dict[str, str]:
    """Run studies into root/NAME, and print how each ended; name -> why it failed, or "".

    scripts: folder of them. quick: whether as smaller jobs. reuse: whether to leave out those that
    have a result.
    """
    failed = {}
    for number, entry in enumerate(entries, 1):
        if reuse and Path(root, entry.name, "summary.json").exists():
            continue
        print(f"{number:2d}/{len(entries)} {entry.name} ... ", end="", flush=True)
        started = time.perf_counter()
        failed[entry.name] = run_entry(scripts, entry, root, quick)
        print(failed[entry.name] or f"{time.perf_counter() - started:.0f} s", flush=True)
    return failed


def run_entry(scripts: str | Path, entry: Entry, root: str, quick: bool = False) -> str:
    """Run a study and note what it printed, for its page; returns why it failed, or ""."""
    folder = output_folder(os.path.join(root, entry.name))
    # None of an earlier run shall pass for this one's.
    for name in ("summary.json", RUN, CAPTION, *entry.pictures):
        Path(folder, name).unlink(missing_ok=True)
    line = [sys.executable, os.path.join(scripts, f"{entry.name}.py"), *entry.options.split()]
    line += ["--out", folder, *(["--quick"] if quick else [])]
    started = time.perf_counter()
    done = children.run(line)
    note = {"seconds": time.perf_counter() - started, "output": done.stdout}
    write_text(os.path.join(folder, RUN), json.dumps(note, indent=1))
    if done.returncode == 0:
        return ""
    said = done.stderr.strip().splitlines() or ["it said nothing"]
    return f"exit code {done.returncode}: {said[-1]}"
