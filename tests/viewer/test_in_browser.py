"""Pages in a headless Chromium at the widths of a telephone and of a desk; skipped without one."""

import html
import json
import re
import shutil
import subprocess

import pytest

from tests.viewer.made import block, damper

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
WIDTHS = (390, 1280)
#: Run before all else of a page: errors are kept, and told even where nothing else is.
EARLY = """<script>
const faults = [];
addEventListener("error", (event) => faults.push(event.message));
console.error = (...words) => faults.push(words.join(" "));
setTimeout(() => parent.postMessage([NUMBER, { faults }], "*"), 500);
</script>"""
#: Run after all else: looks at the picture, moves the slider, and tells the page around it.
LATE = """<script>
const canvas = document.querySelector("#stage canvas"), scrub = byId("scrub");
function colours() {
  const copy = document.createElement("canvas"), size = [canvas.width, canvas.height];
  [copy.width, copy.height] = size;
  const pen = copy.getContext("2d");
  pen.drawImage(canvas, 0, 0);
  return new Set(new Uint32Array(pen.getImageData(0, 0, ...size).data.buffer)).size;
}
function change(input, value) {
  const before = canvas.toDataURL();
  input.value = value;
  input.dispatchEvent(new Event("input"));
  return canvas.toDataURL() !== before;
}
function press(key) {
  document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  return Number(scrub.value);
}
setTimeout(() => {
  const found = { colours: colours(), frames: Number(scrub.max) + 1 };
  found.label = byId("time").textContent;
  found.scrubbed = change(scrub, 1);
  found.keys = [press("ArrowRight"), press("Home"), press("End")];
  const select = byId("colour"), options = select ? [...select.options] : [];
  found.modes = options.slice(1).map((option) => change(select, option.value));
  const magnify = byId("magnify");
  found.magnified = magnify ? change(magnify, magnify.max) : null;
  const unnamed = [...document.querySelectorAll("button, input, select, canvas[tabindex]")];
  found.unnamed = unnamed.filter((one) => !one.labels?.length && !one.ariaLabel).length;
  found.overflow = document.documentElement.scrollWidth - innerWidth;
  found.legend = byId("legend").innerText;
  parent.postMessage([NUMBER, { ...found, faults }], "*");
}, 1000);
</script>"""
#: The page around them: each in a frame, as a notebook shows it; what they tell becomes text.
AROUND = """<!doctype html><body><pre id="told"></pre><script>
const told = [];
addEventListener("message", (event) => {
  told[event.data[0]] = event.data[1];
  document.getElementById("told").textContent = JSON.stringify(told);
});
</script>"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the pages tell, by name and width: one start of the browser for all."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        pytest.skip("there is no Chromium on this machine")
    folder = tmp_path_factory.mktemp("browser")
    pages = {"block": block().show(folder / "a.html"), "damper": damper().show(folder / "b.html")}
    asked = [(name, width) for name in pages for width in WIDTHS]
    frames = [framed(pages[name].text, width, k) for k, (name, width) in enumerate(asked)]
    (folder / "all.html").write_text(AROUND + "".join(frames), encoding="utf-8")
    line = [browser, "--headless", "--no-sandbox", "--use-angle=swiftshader", "--dump-dom"]
    line += ["--enable-unsafe-swiftshader", "--window-size=1400,900", "--virtual-time-budget=20000"]
    line += [f"--user-data-dir={folder / 'profile'}", (folder / "all.html").as_uri()]
    done = subprocess.run(line, capture_output=True, text=True, timeout=240)
    text = re.search(r'<pre id="told">(.*?)</pre>', done.stdout, re.DOTALL)
    assert text and text[1], done.stderr
    return dict(zip(asked, json.loads(html.unescape(text[1]))))


def framed(text, width, number):
    """A page with its probes in a frame of a width."""
    early, late = (probe.replace("NUMBER", str(number)) for probe in (EARLY, LATE))
    probed = text.replace("<head>", "<head>" + early, 1).replace("</body>", late + "</body>", 1)
    return f'<iframe width="{width}" height="844" srcdoc="{html.escape(probed)}"></iframe>'


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", ["block", "damper"])
def test_a_page_draws_and_plays(told, name, width):
    found = told[name, width]
    assert found["faults"] == []
    assert found["overflow"] <= 0 and found["unnamed"] == 0
    assert found["colours"] > 10 and found["scrubbed"]
    assert found["keys"] == [2, 0, found["frames"] - 1]
    if name == "block":
        assert found["frames"] == 5 and found["label"] == "4.0 µs"
        assert found["modes"] == [True] * 4 and found["magnified"]
        assert "slip of a bond: since [µs]" in found["legend"]
    else:
        assert found["frames"] == 6 and found["label"] == "0.0 ms"
        assert "vertical speed of particles [m/s]" in found["legend"]
