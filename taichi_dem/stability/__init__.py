"""Every calculation of a stable step."""
