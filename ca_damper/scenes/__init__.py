"""The scenes of a batch: their numbers, fields, time, and their state as arrays."""
