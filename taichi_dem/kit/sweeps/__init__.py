"""Sweeps: one function over the rows of a table, in many processes or on many machines."""
