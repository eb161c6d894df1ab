"""Pictures of the damper; the only part of the package that imports matplotlib."""
