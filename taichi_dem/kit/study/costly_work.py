"""Costly work: results that are kept, and functions called in processes of their own."""

import hashlib
import importlib.util
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from taichi_dem.kit import children, runtime
from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import output_folder, write_text

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
    work: Callable,
    *,
    arch: str = "",
    threads: int = 1,
    cache: str = "",
    title: str = "",
    **arguments: Any,
) -> Any:
    """Result of work(**arguments) in a new process, on this process's architecture by default.

    work: a function at the top of a script or of a module beside it; arguments and result: as JSON
    has them. cache: a folder of compiled kernels instead of Taichi's own. Raises InputError with
    the end of what the process said, where it failed; title: of the run in that sentence.
    """
    file = Path(str(sys.modules[work.__module__].__file__)).absolute()
    settings: Any = runtime.settings()
    job = [str(file.parent), file.stem, work.__name__, arch or settings.arch, threads, arguments]
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


def cached(
    folder: str, name: str, settings: Any, packages: Iterable[str], compute: Callable[[], dict]
) -> tuple[dict, bool]:
    """Result of ``compute()``, a JSON-like dict, from a file if it was computed before.

    settings: everything else the result depends on, by its content. packages: names of those whose
    sources it depends on. The file's name holds a digest of both: a change of either computes
    anew. Returns (result, whether it came from the file).
    """
    path = Path(output_folder(folder), f"{name}-{digest(settings, packages)}.json")
    if not path.exists():
        result = compute()
        write_text(path, json.dumps(result))
        return result, False
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")).items()), True
    except (OSError, ValueError, AttributeError, RecursionError) as error:
        raise InputError(f"cannot read the kept result {path}: {error}; delete it") from None


def digest(settings: Any, packages: Iterable[str]) -> str:
    """Twelve letters that change with the settings and with any source of the packages."""
    made = hashlib.sha256(identity_of(settings).encode())
    for package in packages:
        root = Path(str(importlib.util.find_spec(package).origin)).parent  # type: ignore[union-attr]
        for path in sorted(root.rglob("*.py")):
            # Pictures change no number.
            if "plot" not in path.relative_to(root).parts:
                made.update(path.read_bytes())
    return made.hexdigest()[:12]
