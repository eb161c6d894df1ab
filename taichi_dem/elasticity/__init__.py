"""Elasticity of bonded tetrahedra: constants of bonds from moduli, and those of a mesh."""
