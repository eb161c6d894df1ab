"""Room of the lists of a contact search beside what each body has."""

SPARE_PAIRS, SPARE_SPHERES, SPARE_NEIGHBOURS = 64, 4096, 1024
