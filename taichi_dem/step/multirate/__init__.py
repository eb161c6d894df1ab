"""Steps that differ from body to body."""
