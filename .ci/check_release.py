"""Whether this checkout can be released: one version, its notes, a clean tree, a free tag.

``make release-check`` runs it, and the wheel's check after it; see RELEASE.md.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def found(pattern, name):
    """First group of a pattern in a file of the repository, "" where it is not found."""
    match = re.search(pattern, (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
    return match[1] if match else ""


def git(*arguments):
    """Output of git in the repository."""
    line = ["git", "-C", str(ROOT), *arguments]
    return subprocess.run(line, capture_output=True, text=True).stdout.strip()


def amiss():
    """Yield a sentence for each thing that a release lacks."""
    version = found(r'^__version__ = "(.+)"', "taichi_dem/kit/version.py")
    cited = found(r"^version: (.+)$", "CITATION.cff")
    if cited != version:
        yield f"CITATION.cff has version {cited}, taichi_dem/kit/version.py {version}"
    if not found(rf"^## \[({re.escape(version)})\] - \d{{4}}-\d\d-\d\d$", "CHANGELOG.md"):
        yield f"CHANGELOG.md has no section '## [{version}] - YYYY-MM-DD'"
    if not found(r"^date-released: (\d{4}-\d\d-\d\d)$", "CITATION.cff"):
        yield "CITATION.cff has no date-released"
    if git("status", "--porcelain"):
        yield "the tree is not clean: git status"
    if git("tag", "--list", f"v{version}"):
        yield f"the tag v{version} exists: raise the version in taichi_dem/kit/version.py"


if __name__ == "__main__":
    sentences = list(amiss())
    print(*(sentences or ["Ready: one version, its notes, a clean tree, a free tag."]), sep="\n")
    sys.exit(bool(sentences))
