"""Self-contained HTML pages that play recorded frames: page, player and packed data.

A page holds its styles, scripts and data, and its Content-Security-Policy forbids any request. The
3-D view is in ``taichi_dem.viewer``, the 2-D view in ``ca_damper.plot``.
"""

from taichi_dem.kit.viewer.packing import pack, quantise, time_unit
from taichi_dem.kit.viewer.page import WebPage, show_page
from taichi_dem.kit.viewer.selection import MOST_BYTES, select_frames

__all__ = [
    "MOST_BYTES",
    "WebPage",
    "pack",
    "quantise",
    "select_frames",
    "show_page",
    "time_unit",
]
