"""Number types shared by all kernels: double precision, small vectors and matrices."""

import numpy as np
import taichi as ti

real = ti.f64
vec2 = ti.types.vector(2, ti.f64)
vec3 = ti.types.vector(3, ti.f64)
vec4 = ti.types.vector(4, ti.f64)
vec6 = ti.types.vector(6, ti.f64)
ivec3 = ti.types.vector(3, ti.i32)
mat3 = ti.types.matrix(3, 3, ti.f64)

#: On the host: one number, or an array of them.
FloatOrArray = float | np.ndarray
