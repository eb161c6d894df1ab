"""What is measured of a run beside its results: energy, divergence, effects, resolution."""
