"""A scene as arrays and as fields on the device: what is constant, and what changes."""
