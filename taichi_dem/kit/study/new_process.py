"""Functions called in processes of their own, with Taichi started and a cache of kernels."""

import json
import os
import sys
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from taichi_dem.kit import children, runtime
from taichi_dem.kit.errors import InputError

_CHILD = """
import importlib, json, sys
folder, module, function, arch, threads, arguments = json.loads(sys.argv[1])
sys.path.insert(0, folder)
work = getattr(importlib.import_module(module), function)
from taichi_dem.kit import runtime
runtime.start(arch, threads)
print(json.dumps(work(**arguments)))
"""


def call_in_process(
    work: Callable, *, threads: int = 1, cache: str = "", title: str = "", **arguments: Any
) -> Any:
    """Result of work(**arguments) in a new process on this process's architecture.

    work: a function at the top of a script or of a module beside it; arguments and result: as JSON
    has them. cache: a folder of compiled kernels instead of Taichi's own. Raises InputError with
    the end of what the process said, where it failed; title: of the run in that sentence.
    """
    file = Path(str(sys.modules[work.__module__].__file__)).absolute()
    settings: Any = runtime.settings()
    job = [str(file.parent), file.stem, work.__name__, settings.arch, threads, arguments]
    environment = dict(os.environ)
    if cache:
        os.makedirs(cache, exist_ok=True)
        environment.update(TI_OFFLINE_CACHE="1", TI_OFFLINE_CACHE_FILE_PATH=cache)
    done = children.run([sys.executable, "-c", _CHILD, json.dumps(job)], env=environment)
    if done.returncode != 0:
        said = done.stderr.strip()[-300:]
        raise InputError(f"the run {title or f'of {work.__name__}'} ended with: {said}")
    # Taichi may have printed lines of its own before.
    return json.loads(done.stdout.splitlines()[-1])


def call_rounds(
    calls: Mapping[str, tuple[Callable, dict]],
    repeats: int,
    workers: int,
    progress: Callable[[int, int], None],
) -> dict[str, list[dict]]:
    """Results of calls in new processes by their names: all of them once before any one again.

    So a busy minute of the machine does not fall on one call alone. calls: (function, arguments) as
    of ``call_in_process``; functions return dicts. Each call has a cache of kernels of its own,
    empty before its first turn; compiled_kB in the result is its size. workers: processes side by
    side. progress: called with the number of turns done and that of all.
    """
    turns, results = [*calls] * repeats, []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        places = {name: Path(folder, str(k)) for k, name in enumerate(calls)}

        def take_turn(name: str) -> dict:
            work, arguments = calls[name]
            found = call_in_process(work, cache=str(places[name]), title=f"of {name}", **arguments)
            size = sum(file.stat().st_size for file in places[name].rglob("*.tic"))
            return {**found, "compiled_kB": 1e-3 * size}

        for result in pool.map(take_turn, turns):
            results.append(result)
            progress(len(results), len(turns))
    return {name: results[k :: len(calls)] for k, name in enumerate(calls)}
