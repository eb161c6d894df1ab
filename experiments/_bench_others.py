"""What other programs take for the work of a figure of the bench, and where that was measured."""

#: Of figures by name, in their unit: value, program and source.
OTHERS = {
    "spheres, N = 50": (16.0, "LAMMPS, granular spheres", "a core with AVX-512, 2026"),
    "bonded phase": (40.0, "C++, the same arithmetic in lanes", "a core with AVX-512, 2026"),
    "visit of a bond": (8.3, "C++, 6x6 block by intrinsics", "in cache, AVX-512, 2026"),
    "paper's problem, implicit": (0.75, "C++, the same method", "0.6 to 0.9 s, AVX-512, 2026"),
    "paper's problem, l = 1e-08 m, extrapolated": (89.0, "C++, the paper's rule", "AVX-512, 2026"),
}
