"""Short films of a demonstration: a GIF for every page, and an MP4 where ffmpeg is found."""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from typing import Any

from taichi_dem.kit.files import renamed_when_done
from taichi_dem.kit.plot_style import STYLE, filming, write_gif
from taichi_dem.kit.validation import FileName

#: Pixels an inch of the MP4; the GIF has half as many each way.
_DPI = 200
_SMALL = {
    **STYLE,
    "font.size": 7.5,
    "axes.titlesize": 7.5,
    "axes.labelsize": 7.5,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "lines.linewidth": 1.2,
}


@contextlib.contextmanager
def moving_picture(
    path: FileName, size: tuple[float, float], milliseconds: float, colours: int = 48
) -> Iterator[Any]:
    """A figure, and a function that takes it as the next frame; files when the block ends well.

    path: of the GIF; the MP4 lies beside it. size: in inches, at most 4 each way for a GIF of
    400 pixels. milliseconds: a frame. The layout is that of the first frame.
    Raises InputError when a file cannot be written.
    """
    with filming(size, _DPI, _SMALL) as (figure, shoot, images):
        yield figure, shoot
    write_gif(path, [image.reduce(2) for image in images], milliseconds, colours)
    write_mp4(os.path.splitext(path)[0] + ".mp4", images, milliseconds)


def write_mp4(path: FileName, images: Any, milliseconds: float) -> Any:
    """Write RGB images of one size as H.264; does nothing and returns False without ffmpeg.

    milliseconds: a frame. A size that is odd loses a row or a column, as the format asks for.
    Raises InputError when the file cannot be written.
    """
    program = shutil.which("ffmpeg")
    if program is None:
        return False
    width, height = images[0].size
    read = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    read += ["-framerate", f"{1000.0 / milliseconds:g}", "-i", "-"]
    even = ["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p"]
    made = b"".join(image.tobytes() for image in images)
    with renamed_when_done(path) as temporary:
        line = [program, "-y", "-loglevel", "error", *read, "-c:v", "libx264", *even, temporary]
        done = subprocess.run(line, input=made, capture_output=True)
        if done.returncode:
            raise OSError(f"ffmpeg says {done.stderr.decode(errors='replace').strip()}")
    return True
