"""A run in the formats of other programs: VTKHDF, extended XYZ, glTF."""
