"""Motion of a contact over a step, from its overlap and approach, wherever in it the step falls.

With y = d^(5/4) and ds = d^(1/4) dt the contact m d'' = -(k d^(3/2) + c d^(1/4) d') is linear:
dy/ds = 5/4 u and du/ds = -(k y + c u) / m. Its matrix exponential is exact, so that the restitution
is too: from the time at which flight takes the bodies to each other, to the point at which they no
longer push. Only the way s that belongs to a step is found to second order.
"""

import struct

import taichi as ti

vec2 = ti.types.vector(2, ti.f64)

# A number whose bits, less a fifth of those of y, are those of y^(-1/5) within 4 %.
_GUESS = struct.unpack("<d", struct.pack("<q", 5528618902560020889 - 150119987579016))[0]


@ti.func
def inverse_fifth_root(y):
    """y^(-1/5) of a number that is not negative; of 0 a large number whose fourth power is one."""
    bits = ti.bit_cast(ti.cast(_GUESS, ti.f64), ti.i64)
    root = ti.bit_cast(bits - ti.bit_cast(ti.cast(y, ti.f64), ti.i64) // 5, ti.f64)
    for _ in ti.static(range(4)):
        square = root * root
        root *= 1.2 - 0.2 * y * square * square * root
    return root


@ti.func
def fourth_root(depth):
    """Fourth root of an overlap."""
    return ti.sqrt(ti.sqrt(depth))


@ti.func
def _series(x, factors: ti.template()):
    """Sum of the factors, the last one first, times the powers of x."""
    total = 0.0 * x
    for factor in ti.static(factors):
        total = total * x + factor
    return total


@ti.func
def moved(spring, dashpot, y, u, way):
    """Take y and the approach u along a way s; spring, dashpot: k and c over the mass."""
    # exp(A s) = own + other A, with A^2 = -c A - 5/4 k: by series of an eighth of the way.
    decay, part = 0.5 * dashpot, 0.125 * way
    x = (1.25 * spring - decay * decay) * part * part
    z = decay * part
    fall = 1.0 / _series(z, (1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 1.0 / 2.0, 1.0, 1.0))
    other = _series(-x, (1.0 / 362880.0, 1.0 / 5040.0, 1.0 / 120.0, 1.0 / 6.0, 1.0)) * fall * part
    own = _series(-x, (1.0 / 40320.0, 1.0 / 720.0, 1.0 / 24.0, 1.0 / 2.0, 1.0)) * fall
    own += decay * other
    for _ in ti.static(range(3)):
        own, other = (
            own * own - 1.25 * spring * other * other,
            2.0 * other * (own - decay * other),
        )
    return own * y + 1.25 * other * u, own * u - other * (spring * y + dashpot * u)


@ti.func
def way_to_end(spring, dashpot, y, u):
    """Way s to where the push falls to zero, for bodies that part."""
    decay, rate = 0.5 * dashpot, -(spring * y + dashpot * u)
    z = rate / (1.25 * spring * u + decay * rate)
    x = ti.max(-1.0, (1.25 * spring - decay * decay) * z * z)
    # An arc tangent, of a negative x that of the hyperbolic tangent, by halves of the angle.
    for _ in ti.static(range(3)):
        half = 1.0 + ti.sqrt(1.0 + x)
        z, x = 2.0 * z / half, x / (half * half)
    return z * (1.0 - x * (1.0 / 3.0 - x * (1.0 / 5.0 - x * (1.0 / 7.0 - x / 9.0))))


@ti.func
def flow(spring, dashpot, overlap, approach, dt):
    """Overlap [m] and approach [m/s] after a time [s]; spring, dashpot: k and c over the mass."""
    left = dt
    if overlap < 0.0:
        left = dt + overlap / approach if approach > 0.0 else 0.0
    depth = ti.max(0.0, overlap)
    quarter = fourth_root(depth)
    push = spring * depth * quarter + dashpot * approach
    result = vec2(overlap + dt * approach, approach)
    if left > 0.0 and (push > 0.0 or approach > 0.0):
        end, limit = _end(spring, dashpot, depth, approach, push * quarter, left)
        if end[0] < left:
            result = vec2(end[1] + (left - end[0]) * end[2], end[2])
        else:
            result = _within(spring, dashpot, depth, approach, push * quarter, left, limit)
    return result


@ti.func
def _end(spring, dashpot, depth, approach, rate, left):
    """Time to the end of a contact, overlap and approach there; the way to it, if it is near."""
    end, limit = ti.Vector([ti.math.inf, 0.0, 0.0]), ti.math.inf
    if approach < 0.0:
        # The push only falls from here: the bodies come no farther than under that of the start.
        far = ti.max(0.0, depth + left * (approach - 0.5 * left * rate))
        if spring * far * fourth_root(far) + dashpot * (approach - left * rate) <= 0.0:
            y = depth * fourth_root(depth)
            limit = way_to_end(spring, dashpot, y, approach)
            last, speed = moved(spring, dashpot, y, approach, limit)
            last = ti.max(0.0, last)
            place, mean = last * inverse_fifth_root(last), 0.5 * (approach + speed)
            time = (place - depth) / mean
            end = ti.Vector([(place - depth) / (mean - time / 12.0 * rate), place, speed])
    return end, limit


@ti.func
def _within(spring, dashpot, depth, approach, rate, left, limit):
    """Overlap and approach after a time in which the contact does not end; rate: of slowing."""
    y = depth * fourth_root(depth)
    middle = ti.max(0.0, depth + 0.5 * left * (approach - 0.25 * left * rate))
    far = ti.max(0.0, depth + left * (approach - 0.5 * left * rate))
    # The mean of d^(1/4) over the time: at a steady approach, or where the overlap stays as it is.
    mean = fourth_root(middle)
    if ti.abs(far - depth) > 0.1 * middle:
        mean = 0.8 * (far * fourth_root(far) - y) / (far - depth)
    y, u = moved(spring, dashpot, y, approach, ti.min(left * mean, limit))
    y = ti.max(0.0, y)
    return vec2(y * inverse_fifth_root(y), u)
