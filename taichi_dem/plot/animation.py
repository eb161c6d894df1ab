"""Animations small enough for a web page."""

import os

import numpy as np
from matplotlib.collections import PolyCollection
from PIL import Image

from taichi_dem.plot.block import View, prepare
from taichi_dem.plot.style import figure
from taichi_dem.record import body_corners


def save_animation(path, model, frames, magnify=1.0, axis=2, colours=32, milliseconds=90):
    """Write the deforming block, coloured by speed, as a GIF of one shared palette.

    frames: at least two. magnify: of the displacement. One palette for all frames and no
    dithering keep 40 frames under a megabyte.
    """
    view = View(model, axis)
    start = model.mesh.points[model.mesh.tetrahedra]
    fastest = max(max(float(frame.speed.max()) for frame in frames), 1e-12)
    # Room by hand: a layout found anew for every frame would let the block jump.
    fig, axes = figure(size=(4.0, 3.3), dpi=100, layout=None)
    fig.subplots_adjust(left=0.14, right=0.92, bottom=0.15, top=0.91)
    drawn = PolyCollection([], cmap="inferno_r", linewidth=0)
    drawn.set_clim(0.0, 1.0)
    axes.add_collection(drawn)
    prepare(axes, model, view.plane)
    bar = fig.colorbar(drawn, ax=axes, label="speed [m/s]", shrink=0.85)
    ticks = np.array([0.0, 0.01, 0.05, 0.2, 0.5, 1.0])
    # A root shows the wave far off and the fragments at the hole in one scale.
    bar.set_ticks(np.sqrt(ticks))
    bar.set_ticklabels([_plain(fastest * tick) for tick in ticks])
    scale = "" if magnify == 1.0 else f", displacement x {magnify:g}"
    images = []
    for frame in frames:
        corners = start + magnify * (body_corners(model, frame) - start)
        polygons, body = view.front_faces(corners)
        drawn.set_verts(polygons)
        drawn.set_array(np.round(24.0 * np.sqrt(frame.speed[body] / fastest)) / 24.0)
        axes.set_title(f"t = {1e3 * frame.time_s:.3f} ms{scale}")
        images.append(_picture(fig))
    _write_gif(path, images, colours, milliseconds)


def _plain(value):
    """A speed to two digits without an exponent where it has a few digits."""
    return f"{float(f'{value:.2g}'):g}"


def _picture(fig):
    fig.canvas.draw()
    return Image.fromarray(np.asarray(fig.canvas.buffer_rgba())[:, :, :3].copy())


def _write_gif(path, images, colours, milliseconds):
    width, height = images[0].size
    sample = Image.new("RGB", (width, 3 * height))
    for row, index in enumerate((0, len(images) // 2, len(images) - 1)):
        sample.paste(images[index], (0, row * height))
    palette = sample.quantize(colours, dither=Image.Dither.NONE)
    reduced = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    temporary = f"{path}.part.gif"
    reduced[0].save(
        temporary, save_all=True, append_images=reduced[1:], duration=milliseconds, loop=0
    )
    os.replace(temporary, path)
