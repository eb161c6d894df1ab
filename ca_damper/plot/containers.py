"""Data of a page that plays containers side by side, made from their frames."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ca_damper.plot.boxes import SPEEDS, BoxSize, Hanging
from ca_damper.report.record import SceneFrame
from ca_damper.spheres import Spheres
from taichi_dem.kit.display import counted, listed, scale
from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, table_of
from taichi_dem.kit.validation import FileName
from taichi_dem.kit.viewer import WebPage, pack, quantise, select_frames, show_page

#: Scenes that a page shows at most, and the colours of their curves.
MOST_SCENES = 6
_COLOURS = (BLUE, RED, GREEN, PURPLE, ORANGE, GREY)
_SCRIPT = Path(__file__).resolve().with_name("containers.js")


def show_film(
    film: Any, scenes: Sequence[int], path: FileName | None, open_browser: bool | None
) -> WebPage:
    """Write the page of a ``Film``; scenes: numbers of those shown; as of ``Film.show``."""
    # A filling without a box of its own is drawn in that of the spheres.
    has_box = hasattr(film.filling, "columns") or hasattr(film.filling, "height")
    box = BoxSize.of(film.filling if has_box else Spheres())
    containers = []
    for scene, colour in zip(scenes, _COLOURS):
        title = counted(len(film.frames[scene][0].position), "particle")
        name = title if len(scenes) == 1 else f"{scene}: {title}"
        containers.append(Hanging(name, box, film.frames[scene], colour))
    every = len(film.frames)
    notes = [f"Scenes {listed(scenes)} of {every:,} shown."] if len(scenes) < every else []
    return show_containers(containers, path, open_browser, mount=film.mount, notes=notes)


def show_containers(
    containers: Sequence[Hanging],
    path: FileName | None,
    open_browser: bool | None = None,
    *,
    mount: str = "spring",
    notes: Sequence[str] = (),
) -> WebPage:
    """Write a page that plays containers side by side, with their displacement over time."""
    rows = list(zip(*(container.frames for container in containers)))
    size = 6 * sum(len(frame.position) for frame in rows[0]) + 24 * len(containers)
    frames, left_out = select_frames(rows, [_is_finite(row) for row in rows], size, 10_000)
    factor, unit = scale(frames[-1][0].time_s, "s")
    fastest = _fastest(frames)
    data = {
        "unit": unit,
        "times": [factor * row[0].time_s for row in frames],
        "mount": mount,
        "containers": [
            _drawn(container, shots) for container, shots in zip(containers, zip(*frames))
        ],
        "curves": [
            {
                **{"name": container.title, "colour": container.colour},
                "times": [factor * frame.time_s for frame in shots],
                "values": [1e3 * frame.x for frame in shots],
            }
            for container, shots in zip(containers, zip(*frames))
        ],
        "curveLabel": "displacement [mm]",
        "speed": {
            **{"label": "vertical speed of particles [m/s]", "low": -fastest, "high": fastest},
            "table": pack(table_of(SPEEDS(np.linspace(0.0, 1.0, 256))), "uint8"),
        },
    }
    words = [", ".join(container.title for container in containers), counted(len(frames), "frame")]
    content = {"title": "Granular damper", "subtitle": "; ".join(words)}
    notes = [*notes, *left_out]
    return show_page(path, open_browser, [_SCRIPT], data=data, notes=notes, **content)


def _is_finite(row: Sequence[SceneFrame]) -> bool:
    values = (value for frame in row for value in (frame.x, frame.y, frame.position))
    return all(bool(np.isfinite(value).all()) for value in values)


def _fastest(frames: Sequence[Sequence[SceneFrame]]) -> float:
    """End of the colour scale: a speed that one of a hundred particles exceeds."""
    speeds = [np.abs(frame.velocity[:, 1]) for row in frames for frame in row]
    return float(np.percentile(np.concatenate([*speeds, [1e-9]]), 99)) or 1.0


def _drawn(container: Hanging, frames: Sequence[SceneFrame]) -> dict[str, Any]:
    """What is drawn of a container, in mm; frames: those that the page holds."""
    first, box = frames[0], container.box
    diameters = np.full(len(first.position), box.diameter)
    return {
        **{"title": container.title, "colour": container.colour},
        **{"width": 1e3 * box.width, "height": 1e3 * float(np.ptp(box.outline()[:, 1]))},
        "outline": (1e3 * box.outline()).tolist(),
        "lift": [float(1e3 * box.lift(frame.x)) for frame in frames],
        "base": [1e3 * frame.y for frame in frames],
        "diameters": (1e3 * (diameters if first.diameter is None else first.diameter)).tolist(),
        "position": quantise([1e3 * frame.position for frame in frames]),
        "speed": quantise([frame.velocity[:, 1] for frame in frames]),
    }
