"""A page as a file, in a browser, and in the cell of a notebook."""

import html
import os
import sys
import tempfile
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from taichi_dem.kit.display import in_brief
from taichi_dem.kit.files import write_text
from taichi_dem.kit.progress.progress import drawing
from taichi_dem.kit.validation import FileName, flag, path_name

_HERE = Path(__file__).resolve().parent
#: Height of the page in the cell of a notebook [pixels].
_CELL_HEIGHT = 680


class WebPage(os.PathLike):
    """A page that was written.

    As the last line of a notebook's cell it shows itself; ``open``, ``Path`` and ``str`` take it
    as the path of its file.

    Parameters
    ----------
    path : str
        Of the file.
    text : str
        The whole page.
    """

    def __init__(self, path: str, text: str):
        self.path, self.text = path, text

    def __repr__(self) -> str:
        return in_brief(self, self.path, f"{len(self.text.encode()) / 1e6:.2g} MB")

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
    """Write a page and open it where somebody watches.

    Parameters
    ----------
    path : file name or None
        None for a file in a new folder for temporary files.
    open_browser : bool or None
        None to open it only from a terminal of a desktop: not in a pipe, a test, a notebook or on
        a build server.
    scripts : sequence of file name
        JavaScript of the view, run after ``player.js`` in this order.
    **content
        title, subtitle: text above the view. notes: sentences below it. data: what the scripts
        find in ``view``, fit for JSON.

    Returns
    -------
    WebPage

    Raises
    ------
    InputError
        When the file cannot be written.
    """
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
    """The page as one text."""
    # Imported here, since every import of the package would wait for it.
    from jinja2 import Environment, FileSystemLoader

    options: Any = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}
    environment = Environment(loader=FileSystemLoader(_HERE), **options)
    sources = [_HERE / "page.css", _HERE / "player.js", *map(Path, scripts)]
    style, *parts = (source.read_text(encoding="utf-8") for source in sources)
    return environment.get_template("page.html").render(style=style, scripts=parts, **content)


def _is_on_desktop() -> bool:
    """Whether a person at a terminal would see a window open."""
    if sys.stdout is None or not sys.stdout.isatty():
        return False
    if "CI" in os.environ or "PYTEST_CURRENT_TEST" in os.environ:
        return False
    has_display = "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    return has_display or sys.platform in ("darwin", "win32")
