"""Meshes of tetrahedra and their geometry; NumPy only."""
