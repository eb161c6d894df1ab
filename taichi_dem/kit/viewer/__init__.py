"""Self-contained HTML pages that play recorded frames: page, player and packed data."""

import base64
import html
import os
import sys
import tempfile
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_text
from taichi_dem.kit.progress import drawing
from taichi_dem.kit.validation import FileName, flag, path_name, told_apart

#: Largest page [bytes], and letters of base64 for a byte.
MOST_BYTES, _BASE64 = 30_000_000, 4.0 / 3.0
#: Largest magnitude of a quantised value.
_MOST = 32767
_HERE = Path(__file__).resolve().parent
#: Height of the page in the cell of a notebook [pixels].
_CELL_HEIGHT = 680


class WebPage(os.PathLike):
    """A page that was written.

    As the last line of a notebook's cell it shows itself; ``open``, ``Path`` and ``str`` take it.
    """

    def __init__(self, path: str, text: str):
        self.path, self.text = path, text

    def __repr__(self) -> str:
        return f"<WebPage: {self.path}, {len(self.text.encode()) / 1e6:.2g} MB>"

    def __str__(self) -> str:
        return self.path

    def __fspath__(self) -> str:
        return self.path

    def _repr_html_(self) -> str:
        style = f"width:100%;height:{_CELL_HEIGHT}px;border:0"
        return f'<iframe title="Viewer" style="{style}" srcdoc="{html.escape(self.text)}"></iframe>'


def show_page(
    path: FileName | None,
    open_browser: bool | None,
    scripts: Sequence[FileName],
    **content: Any,
) -> WebPage:
    """Write a page and open it where somebody watches."""
    wanted = _is_on_desktop() if open_browser is None else flag("open_browser", open_browser)
    name = None if path is None else path_name("path", path)
    if name is not None:
        drawing(name)
    text = _page_text(scripts, **content)
    if name is None:
        name = os.path.join(tempfile.mkdtemp(prefix="taichi_dem_"), "view.html")
    write_text(name, text)
    page = WebPage(os.path.abspath(name), text)
    if wanted:
        webbrowser.open(Path(page.path).as_uri())
    return page


def _page_text(scripts: Sequence[FileName], **content: Any) -> str:
    # Imported here, since every import of the package would wait for it.
    from jinja2 import Environment, FileSystemLoader

    options: Any = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    environment = Environment(loader=FileSystemLoader(_HERE), **options)
    sources = [_HERE / "page.css", _HERE / "player.js", *map(Path, scripts)]
    style, *parts = (source.read_text(encoding="utf-8") for source in sources)
    return environment.get_template("page.html").render(style=style, scripts=parts, **content)


def _is_on_desktop() -> bool:
    """Whether a person at a terminal would see a window open."""
    if (
        sys.stdout is None
        or not sys.stdout.isatty()
        or {"CI", "PYTEST_CURRENT_TEST"} & {*os.environ}
    ):
        return False
    has_display = "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    return has_display or sys.platform in ("darwin", "win32")


def pack(values: object, kind: str) -> dict[str, Any]:
    """Pack an array for a page: kind, and data, its bytes in C order, little-endian, in base64."""
    packed = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return {"kind": kind, "data": base64.b64encode(packed.tobytes()).decode("ascii")}


def quantise(frames: Sequence[np.ndarray]) -> dict[str, Any]:
    """Pack finite arrays of equal size as 16-bit whole numbers, each with a scale of its own."""
    # Each frame has its own scale; the error is at most half of it, its largest magnitude / 65534.
    rows = np.array([np.ravel(frame) for frame in frames], dtype=float)
    scale = np.abs(rows).max(axis=1, initial=0.0) / _MOST
    whole = np.rint(rows / np.where(scale > 0.0, scale, 1.0)[:, None])
    return {**pack(whole, "int16"), "scale": scale.tolist()}


def select_frames(
    frames: Sequence[Any], finite: Sequence[bool], frame_bytes: int, other_bytes: int
) -> tuple[list[Any], list[str]]:
    """Select the frames that a page holds, and say in sentences what is left out."""
    notes, kept = [], [frame for frame, good in zip(frames, finite) if good]
    if not kept:
        raise InputError("frames must hold at least one finite snapshot, got none")
    if len(kept) < len(frames):
        notes.append(f"{counted(len(frames) - len(kept), 'frame')} with infinite values left out.")
    most = int((MOST_BYTES / _BASE64 - other_bytes) // max(1, frame_bytes))
    if most < 2:
        size = _BASE64 * (2 * frame_bytes + other_bytes) / 1e6
        got, room = told_apart(size, MOST_BYTES / 1e6)
        raise InputError(f"scene must fit a page of {room} MB, got {got} MB for two frames")
    if len(kept) > most:
        notes.append(
            f"{most:,} of {len(kept):,} frames shown: a page has at most {MOST_BYTES // 10**6} MB."
        )
        kept = [kept[k] for k in np.linspace(0, len(kept) - 1, most).round().astype(int)]
    return kept, notes
