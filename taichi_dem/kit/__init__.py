"""Tools without physics, shared with ca_damper: session, checks, files, checkpoints, progress."""
