"""A headless Chromium, for tests of pages: it opens one, runs a script in it, takes a picture."""

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

NAMES = "chromium", "chromium-browser", "google-chrome"
#: It has half a minute of its own clock, which does not run while the browser works.
OPTIONS = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=30000"]
#: Puts what the body of a function returns into the title, which the browser prints.
SCRIPT = (
    "<script>(async () => {%s})().then((told) => document.title = JSON.stringify(told))</script>"
)


def chromium():
    """Path of a browser; skips the test where there is none."""
    cached = sorted(Path.home().glob(".cache/ms-playwright/chromium*/chrome-linux*/chrome"))
    found = [*filter(None, map(shutil.which, NAMES)), *map(str, cached)]
    return found[0] if found else pytest.skip("there is no Chromium on this machine")


def run_in_page(path, state, script, size=(1280, 800)):
    """Open a page with a state in its address and run a script in it; returns what that returns.

    script: body of an asynchronous function. size: of the window [pixels]. A picture of the page
    after the script stands beside it, as NAME.png.
    """
    browser, copy, shot = chromium(), path.with_suffix(".run.html"), path.with_suffix(".png")
    copy.write_text(
        path.read_text("utf-8").replace("</body>", SCRIPT % script + "</body>"), "utf-8"
    )
    line = [browser, *OPTIONS, "--window-size={},{}".format(*size), f"--screenshot={shot}"]
    line += ["--dump-dom", copy.as_uri() + state]
    done = subprocess.run(line, capture_output=True, encoding="utf-8", timeout=120.0)
    found = re.search(r"<title>(.*?)</title>", done.stdout)
    assert found, done.stderr[-1000:]
    return json.loads(html.unescape(found[1]))
