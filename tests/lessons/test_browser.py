"""A lesson in a real browser: a slider is moved, and the picture changes.

Needs marimo, playwright and a Chromium (Debian's, or one that playwright has fetched).
"""

import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from tests.scenes import ROOT

NAME, PICTURE = "why_a_box_of_grains_damps", "img[alt^=Response]"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
#: Compiling on a busy machine; an answer takes about a second.
MOST_S = 120.0


@pytest.fixture(scope="module")
def page():
    """An empty page of a headless Chromium."""
    pytest.importorskip("marimo", reason="marimo is not installed: make lessons installs it")
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    with api.sync_playwright() as playwright:
        if found is None and not os.path.exists(playwright.chromium.executable_path):
            pytest.skip("there is no Chromium on this machine")
        browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        yield browser.new_page(viewport={"width": 1280, "height": 1400})
        browser.close()


@pytest.fixture(scope="module")
def address(page):
    """Where a server of the lesson answers, on this machine only."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    path = Path(ROOT) / "experiments" / "lessons" / f"{NAME}.py"
    line = [sys.executable, "-m", "marimo", "run", str(path), "--headless"]
    line += ["--host", "127.0.0.1", "--port", str(port)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(line, **quiet) as server:
        url = f"http://127.0.0.1:{port}"
        try:
            wait(lambda: answers(url))
            yield url
        finally:
            server.terminate()


def answers(url):
    """Whether a server is there."""
    try:
        with urllib.request.urlopen(url, timeout=5.0):
            return True
    except OSError:
        return False


def wait(done):
    """Wait until something is so; fails when it takes too long."""
    end = time.monotonic() + MOST_S
    while not done():
        assert time.monotonic() < end, "nothing has happened"
        time.sleep(0.02)


@pytest.mark.slow
def test_moving_a_slider_changes_the_picture(page, address):
    """And nothing is fetched from elsewhere; an answer comes with a guess, and only then."""
    asked, faults = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(address)
    page.wait_for_selector(PICTURE, timeout=1e3 * MOST_S)
    image = page.locator(PICTURE)
    before, words = image.get_attribute("src"), page.inner_text("body")
    slider = page.locator("[role=slider]").first
    slider.focus()
    page.keyboard.press("ArrowLeft")
    wait(lambda: image.count() == 1 and image.get_attribute("src") != before)
    assert "The box swings by" in words and page.inner_text("body") != words
    assert "The three bars add up" not in page.inner_text("body")
    for guess, verdict in (
        ("into friction at the walls", "Not so, but:"),
        ("into blows", "Right."),
    ):
        page.get_by_text(guess, exact=True).click()
        wait(lambda verdict=verdict: verdict in page.inner_text("body"))
        assert "The three bars add up" in page.inner_text("body")
    foreign = [url for url in asked if not url.startswith((address, "data:", "blob:", "ws://127."))]
    assert not foreign and not faults
