"""Stepping of the scenes: container, coupling, account, and the engine that holds them."""
