"""Diagnostics of a run: energy balance, divergence, missing effects, step resolution."""
