"""Whether the tests notice a wrong line: each mutant of ``mutants.txt`` is made and tested.

    python -m tests.mutants                 the test files that a mutant names, until one test fails
    python -m tests.mutants --only contact  mutants whose area or name has this word
    python -m tests.mutants --check         only ask whether each mutant can be made

Each is made in a copy of the checkout. Only tests that a change must pass count: none of the second
tier is run.
"""

import argparse
import collections
import concurrent.futures
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
#: A run that takes longer has a mutant that hangs, and so is noticed [s].
MOST_SECONDS = 900

Mutant = collections.namedtuple("Mutant", "area name path old new tests")
Verdict = collections.namedtuple("Verdict", "name verdict by seconds")


def mutants(text):
    """The mutants of a table: an area after ``#``; blocks of a name, a file, two lines, tests."""
    found, area = [], ""
    for block in re.split(r"\n\s*\n", text.strip()):
        if block.startswith("#"):
            area = block.lstrip("# ")
            continue
        name, path, old, new, tests = (line.strip() for line in block.splitlines())
        if not (old.startswith("- ") and new.startswith("+ ")):
            raise ValueError(f"{name}: a mutant has a line after '- ' and one after '+ '")
        found.append(Mutant(area, name, path, old[2:], new[2:], tests.split()))
    return found


def table():
    """The mutants of this project."""
    return mutants((HERE / "mutants.txt").read_text(encoding="utf-8"))


def changed(source, mutant):
    """The source with the mutant's line; its old text must occur once."""
    if source.count(mutant.old) != 1:
        times = source.count(mutant.old)
        raise ValueError(f"{mutant.name}: {mutant.old!r} occurs {times} times in {mutant.path}")
    return source.replace(mutant.old, mutant.new)


def faults(mutant, root=ROOT):
    """What keeps a mutant from being made and tested, as sentences."""
    missing = [name for name in [mutant.path, *mutant.tests] if not (root / name).exists()]
    if missing:
        return [f"{mutant.name}: there is no {name}" for name in missing]
    try:
        source = changed((root / mutant.path).read_text(encoding="utf-8"), mutant)
        compile(source, mutant.path, "exec")
    except (ValueError, SyntaxError) as error:
        return [f"{mutant.name}: {error}"]
    return []


def copied(root, folder):
    """A copy of the files that Git knows, as they are now."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, check=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        if (root / name).exists():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folder / name)
    return folder


def tested(folder, mutant):
    """Make the mutant in a copy, run pytest until a test fails, and undo it."""
    path = folder / mutant.path
    source = path.read_text(encoding="utf-8")
    path.write_text(changed(source, mutant), encoding="utf-8")
    begun = time.monotonic()
    try:
        verdict, by = _run(folder, mutant.tests)
    finally:
        path.write_text(source, encoding="utf-8")
    return Verdict(mutant.name, verdict, by, round(time.monotonic() - begun, 1))


def _run(folder, arguments):
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", "-p", "no:cacheprovider"]
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(
            [*command, *arguments],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=MOST_SECONDS,
        )
    except subprocess.TimeoutExpired:
        return "killed", f"hangs for {MOST_SECONDS} s"
    if done.returncode == 0:
        return "survived", ""
    first = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    if first:
        return "killed", first[1]
    if done.returncode < 0:
        return "killed", f"signal {-done.returncode}"
    raise RuntimeError(f"pytest ended with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr}")


def verdicts(chosen, jobs):
    """Test mutants side by side, each in a copy of its own, and yield verdicts as they come."""
    with tempfile.TemporaryDirectory() as temporary:
        copies = queue.Queue()
        for number in range(jobs):
            copies.put(copied(ROOT, Path(temporary, str(number))))

        def judged(mutant):
            folder = copies.get()
            try:
                return tested(folder, mutant)
            finally:
                copies.put(folder)

        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            for done in concurrent.futures.as_completed(pool.submit(judged, m) for m in chosen):
                yield done.result()


def main():
    """Judge the mutants that are asked for; one survivor is a failure."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", default="", help="a word of the area or the name")
    parser.add_argument("--check", action="store_true", help="only ask whether mutants can be made")
    parser.add_argument("--jobs", type=int, default=2, help="how many at a time (2)")
    asked = parser.parse_args()
    chosen = [m for m in table() if asked.only in m.area or asked.only in m.name]
    wrong = [fault for mutant in chosen for fault in faults(mutant)]
    if wrong or asked.check:
        print("\n".join(wrong or [f"{len(chosen)} mutants can be made."]))
        return bool(wrong)
    ends = collections.Counter()
    for verdict in verdicts(chosen, asked.jobs):
        ends[verdict.verdict] += 1
        print(f"{verdict.verdict:9} {verdict.seconds:6.1f} s  {verdict.name}  {verdict.by}")
    print(f"{ends['killed']} of {len(chosen)} killed")
    return ends["survived"] > 0


if __name__ == "__main__":
    sys.exit(main())
