"""Make the meshes that the package carries; needed only to change them.

Writes paper_block.msh into taichi_dem/meshes: the block of Konno et al., section 4.1 and Fig 10,
2.0 m x 2.0 m, 0.2 m deep, a hole of 5 cm diameter 40 cm from the right face. The paper's mesh has
277 nodes and 962 tetrahedra; this one has 966 tetrahedra and 302 nodes: the circle is cut into 8
chords of 2 cm, elements measure 5.5 cm along the hole and grow linearly to 50 cm at 1.1 m from it.
Far size, growth and diagonals were chosen, among 1500 meshes tried, for the largest stable time
step.

Needs gmsh: ``make mesh`` installs it and runs this script. Takes two seconds.
"""

import os
import sys

from taichi_dem import CONCRETE, PAPER_BLOCK, Scene, read_mesh, step_report
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.study import bare_parser, main_of_tool
from taichi_dem.mesh.gmsh import block_with_hole


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


if __name__ == "__main__":
    sys.exit(main())
