"""Spare entries of the lists of a contact search, beside those of each body."""

SPARE_PAIRS, SPARE_SPHERES, SPARE_NEIGHBOURS = 64, 4096, 1024
