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


def call_all(
    calls: Mapping[str, tuple[Callable, dict]], workers: int, progress: Callable[[int, int], None]
) -> dict[str, dict]:
    """Results of calls in new processes, by their names.

    calls: (function, arguments) as of ``call_in_process``; functions return dicts. Each call has an
    empty cache of kernels of its own, whose size in the end is compiled_kB in the result. workers:
    processes side by side. progress: called with the number of calls done and that of all.
    """

    def call(name: str) -> dict:
        work, arguments = calls[name]
        with tempfile.TemporaryDirectory() as cache:
            found = call_in_process(work, cache=cache, title=f"of {name}", **arguments)
            size = sum(file.stat().st_size for file in Path(cache).rglob("*.tic"))
        return {**found, "compiled_kB": 1e-3 * size}

    found = {}
    with ThreadPoolExecutor(workers) as pool:
        for name, result in zip(calls, pool.map(call, calls)):
            found[name] = result
            progress(len(found), len(calls))
    return found
