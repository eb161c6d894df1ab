"""Blasting and breaking of blocks of bonded rigid tetrahedra, with steps that differ by body."""
