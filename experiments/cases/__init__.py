"""Meshes, scenes and cases that experiments and tests share; they import neither."""
