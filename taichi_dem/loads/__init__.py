"""Effects on single bodies: loads, supports, ground."""
