"""Meshes of tetrahedra and all that follows from their geometry; NumPy only."""
