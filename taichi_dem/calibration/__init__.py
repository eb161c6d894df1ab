"""Constants of bonds from the strengths and moduli that specimens of a mesh are to show."""
