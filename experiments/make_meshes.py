"""Make the meshes that come with the package; needed only to change them.

Writes paper_block.msh into taichi_dem/meshes: the block of Konno et al., section 4.1 and Fig 10,
2.0 m x 2.0 m, 0.2 m deep, a hole of 5 cm diameter 40 cm from the right face. The paper's mesh has
277 nodes and 962 tetrahedra; this one has 966 tetrahedra and 302 nodes: the circle is cut into 8
chords of 2 cm, elements measure 5.5 cm along the hole and grow linearly to 50 cm at 1.1 m from it.
Far size, growth and diagonals give the largest stable time step among 1500 meshes tried.

And parallel.msh and V_cut.msh into experiments/tunnel_meshes: rock with the holes of two tunnel
rounds, some 5,000 tetrahedra, each the one with the largest stable step of six.

Needs gmsh: ``make mesh`` installs it and runs this script.
"""

import os
import sys

from cases.tunnel import KEPT, KEPT_NEAR, MESHES, designs, mesh_of, scene_of
from taichi_dem import CONCRETE, PAPER_BLOCK, Scene, read_mesh, step_report
from taichi_dem.kit.files import output_folder, renamed_when_done
from taichi_dem.kit.study import bare_parser, main_of_tool
from taichi_dem.mesh.files import write_mesh
from taichi_dem.mesh.gmsh import session

#: Front view of the block [m]: its edge, and the hole's place, radius and chords.
EDGE, HOLE, RADIUS, CHORDS = 2.0, (1.6, 1.0), 0.025, 8
#: Distance from the hole's wall at which elements have their full size [m].
FAR = 1.11


def main(arguments=None):
    """Write the meshes and print their quality; returns the exit code."""
    made = bare_parser("make_meshes", __doc__.splitlines()[0])
    made.add_argument("--out", default=os.path.dirname(PAPER_BLOCK), help="folder to write to")
    return main_of_tool(lambda options: write(options.out), made, arguments)


def write(folder):
    """Write the meshes to a folder and print their quality."""
    path = os.path.join(output_folder(folder), "paper_block.msh")
    block_with_hole(path)
    print(path)
    print(step_report(Scene(read_mesh(path), CONCRETE, "all")))
    for name, file in KEPT.items():
        write_mesh(MESHES / file, best_of_six(name, designs()[name]))
        print(MESHES / file)


def best_of_six(name, design):
    """Of six meshes of a tunnel round the one with the largest stable step."""
    meshes = [mesh_of(name, design, KEPT_NEAR, seed) for seed in range(6)]
    scenes = [scene_of(mesh, design) for mesh in meshes]
    steps = [step_report(scene).limits["bond_stiffness"].min() for scene in scenes]
    return meshes[steps.index(max(steps))]


def block_with_hole(path, depth=0.2, size_hole=0.055, size_far=0.5):
    """Write the block as a Gmsh 4.1 text file, the same one every time; all lengths in m.

    It fills [0, 2] x [0, 2] x [0, depth] (x right, y up, z to the viewer). The hole is a prism, its
    wall regular triangles in layers of about ``size_hole``; elements grow linearly from there to
    ``size_far``. Physical groups: volume block; faces hole, left, right, bottom, top, back, front.
    Raises InputError when gmsh is not installed or fails, or the file cannot be written.
    """
    with session("block_with_hole") as gmsh:
        walls = add_geometry(gmsh.model, depth)
        divide_walls(gmsh.model, walls, max(1, round(depth / size_hole)))
        add_sizes(gmsh.model.mesh.field, size_hole, size_far)
        gmsh.model.mesh.generate(3)
        with renamed_when_done(path) as temporary:
            gmsh.write(temporary)


def add_geometry(model, depth):
    """Front view with its hole, drawn at z = 0 and drawn out along z; groups. The hole's walls."""
    geo, (x, y), r = model.geo, HOLE, RADIUS
    corners = [(0.0, 0.0), (EDGE, 0.0), (EDGE, EDGE), (0.0, EDGE)]
    corners = [geo.addPoint(*place, 0.0) for place in corners]
    middle = geo.addPoint(x, y, 0.0)
    quarters = [(x + r, y), (x, y + r), (x - r, y), (x, y - r)]
    ends = [geo.addPoint(*place, 0.0) for place in quarters]
    # Anticlockwise from the lower left corner: bottom, right, top, left.
    outline = [geo.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4)]
    circle = [geo.addCircleArc(ends[k], middle, ends[(k + 1) % 4]) for k in range(4)]
    back = geo.addPlaneSurface([geo.addCurveLoop(outline), geo.addCurveLoop(circle)])
    front, volume, *sides = [tag for _, tag in geo.extrude([(2, back)], 0.0, 0.0, depth)]
    geo.synchronize()
    faces = dict(zip(("bottom", "right", "top", "left"), ([tag] for tag in sides[:4])))
    faces.update(hole=sides[4:], back=[back], front=[front])
    model.addPhysicalGroup(3, [volume], name="block")
    for name, tags in faces.items():
        model.addPhysicalGroup(2, tags, name=name)
    return sides[4:]


def divide_walls(model, walls, layers):
    """Regular triangles on the hole's walls: chords of each around it, layers along it."""
    for wall in walls:
        for _, curve in model.getBoundary([(2, wall)], combined=False):
            arc = model.getType(1, abs(curve)) == "Circle"
            model.mesh.setTransfiniteCurve(abs(curve), (CHORDS // 4 if arc else layers) + 1)
        # Alternating diagonals: all of one hand would give the block a twist.
        model.mesh.setTransfiniteSurface(wall, "AlternateRight")


def add_sizes(field, near, far):
    """Element size: linear in the distance from the hole's wall."""
    (x, y), growth = HOLE, (far - near) / FAR
    away = f"Max(Sqrt((x-{x!r})^2+(y-{y!r})^2)-{RADIUS!r}, 0)"
    low, high = sorted((near, far))
    tag = field.add("MathEval")
    field.setString(tag, "F", f"Min(Max({near!r}+{growth!r}*{away}, {low!r}), {high!r})")
    field.setAsBackgroundMesh(tag)


if __name__ == "__main__":
    sys.exit(main())
