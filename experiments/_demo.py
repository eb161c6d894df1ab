"""What the demonstrations of the blast share: several solids in one scene, and their caption."""

import os
import textwrap

import numpy as np

from _cli import print_figures, write_summary
from taichi_dem import checked_mesh
from taichi_dem.kit.files import write_text


def placed_together(parts):
    """One mesh of several solids that do not touch; bodies in the order of the parts.

    parts: name -> (mesh, shift (3,) [m]). Groups: those of every part as NAME_GROUP, and, under
    its own name, a group of all parts together.
    """
    points, tetrahedra, groups, first = [], [], {}, 0
    for name, (mesh, shift) in parts.items():
        points.append(mesh.points + np.asarray(shift))
        tetrahedra.append(mesh.tetrahedra + first)
        for group, faces in mesh.groups.items():
            groups[f"{name}_{group}"] = faces + first
            groups.setdefault(group, []).append(faces + first)
        first += mesh.point_count
    joined = {key: np.vstack(faces) for key, faces in groups.items()}
    return checked_mesh(np.vstack(points), np.vstack(tetrahedra), joined)


def conclude(options, name, figures, caption, simulations):
    """Write summary.json and caption.txt; print the figures and the caption."""
    write_summary(
        options.out,
        name,
        figures,
        compile_seconds=sum(made.compile_seconds for made in simulations),
        run_seconds=sum(made.run_seconds for made in simulations),
    )
    write_text(os.path.join(options.out, "caption.txt"), caption + "\n")
    print_figures(figures)
    print("\n" + textwrap.fill(caption, 100))
    print(f"\nPictures and tables are in {options.out}")
