"""Meshes that come with the package, as files for ``read_mesh``."""

from pathlib import Path

#: The block of Konno et al., 966 tetrahedra: 2 m x 2 m x 0.2 m with a hole to blast, group "hole".
PAPER_BLOCK = str(Path(__file__).with_name("paper_block.msh"))
