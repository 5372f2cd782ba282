"""Elementary functions of the kernel: IEEE + - * / and square root, in a fixed order.

Results of mathematical libraries differ in the last digits between systems, and compilers may use
different libraries for different processors. These functions give the same bits wherever doubles
conform to IEEE 754 and products and sums are rounded separately (ensured by `OPTIONS` of
`slipgrasp.core.kernel.compilation.compiler`). The error bounds are the largest errors found at
10^7 points each (``python -m benchmarks elementary``), rounded up; one ulp is the distance between
adjacent doubles at the exact value.

Sources:

- Coefficients of sine, cosine, arc tangent, exponential and logarithm: Sun's fdlibm 5.3, files
  k_sin.c, k_cos.c, s_atan.c, e_exp.c, e_log.c. "Copyright (C) 1993 by Sun Microsystems, Inc. All
  rights reserved. Developed at SunSoft, a Sun Microsystems, Inc. business. Permission to use,
  copy, modify, and distribute this software is freely granted, provided that this notice is
  preserved."
- Exact products and sums: Dekker, *A floating-point technique for extending the available
  precision*, Numerische Mathematik 18 (1971); Knuth, *The Art of Computer Programming* 2, 4.2.2.
- Quantile of the normal distribution: Wichura, *Algorithm AS 241*, Applied Statistics 37 (1988).
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled

LARGEST_ANGLE = 2.0**30
LEAST_EXPONENT, LARGEST_EXPONENT = -708.0, 709.0
LEAST_NORMAL, LARGEST_NORMAL = 2.0**-1022, (2.0 - 2.0**-52) * 2.0**1023

_SPLITTER = 2.0**27 + 1.0
_ROUNDER = 1.5 * 2.0**52
_MANTISSA_BITS, _EXPONENT_BIAS = 52, 1023
_MANTISSA = (1 << _MANTISSA_BITS) - 1

_INVERSE_HALF_PI = 6.36619772367581382433e-01
# pi/2 to 160 bits as a sum of three doubles.
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33)
_EIGHTH_TURN = 0.7853981633974483
_PI = (3.141592653589793, 1.2246467991473532e-16)
# ln 2 as a sum; the first term has 33 bits, so that its product with an exponent is exact.
_LN2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
_INVERSE_LN2 = 1.44269504088896338700e00
# Polynomials, highest power first.
_EXP = (
    4.13813679705723846039e-08,
    -1.65339022054652515390e-06,
    6.61375632143793436117e-05,
    -2.77777777770155933842e-03,
    1.66666666666666019037e-01,
)
_LOG_EVEN = (1.531383769920937332e-01, 2.222219843214978396e-01, 3.999999999940941908e-01)
_LOG_ODD = (
    1.479819860511658591e-01,
    1.818357216161805012e-01,
    2.857142874366239149e-01,
    6.666666666666735130e-01,
)
_ATAN_ODD = (
    1.62858201153657823623e-02,
    4.97687799461593236017e-02,
    6.66107313738753120669e-02,
    9.09088713343650656196e-02,
    1.42857142725034663711e-01,
    3.33333333333329318027e-01,
)
_ATAN_EVEN = (
    -3.65315727442169155270e-02,
    -5.83357013379057348645e-02,
    -7.69187620504482999495e-02,
    -1.11111104054623557880e-01,
    -1.99999999998764832476e-01,
)
_ATAN_HALF = (4.63647609000806093515e-01, 2.26987774529616870924e-17)
_ATAN_ONE = (7.85398163397448278999e-01, 3.06161699786838301793e-17)

# AS 241, PPND16: numerator and denominator for the centre, the near tail and the far tail.
_CENTRE = (
    (
        2.5090809287301226727e3,
        3.3430575583588128105e4,
        6.7265770927008700853e4,
        4.5921953931549871457e4,
        1.3731693765509461125e4,
        1.9715909503065514427e3,
        1.3314166789178437745e2,
        3.3871328727963666080e0,
    ),
    (
        5.2264952788528545610e3,
        2.8729085735721942674e4,
        3.9307895800092710610e4,
        2.1213794301586595867e4,
        5.3941960214247511077e3,
        6.8718700749205790830e2,
        4.2313330701600911252e1,
        1.0,
    ),
)
_NEAR_TAIL = (
    (
        7.74545014278341407640e-4,
        2.27238449892691845833e-2,
        2.41780725177450611770e-1,
        1.27045825245236838258e0,
        3.64784832476320460504e0,
        5.76949722146069140550e0,
        4.63033784615654529590e0,
        1.42343711074968357734e0,
    ),
    (
        1.05075007164441684324e-9,
        5.47593808499534494600e-4,
        1.51986665636164571966e-2,
        1.48103976427480074590e-1,
        6.89767334985100004550e-1,
        1.67638483018380384940e0,
        2.05319162663775882187e0,
        1.0,
    ),
)
_FAR_TAIL = (
    (
        2.01033439929228813265e-7,
        2.71155556874348757815e-5,
        1.24266094738807843860e-3,
        2.65321895265761230930e-2,
        2.96560571828504891230e-1,
        1.78482653991729133580e0,
        5.46378491116411436990e0,
        6.65790464350110377720e0,
    ),
    (
        2.04426310338993978564e-15,
        1.42151175831644588870e-7,
        1.84631831751005468180e-5,
        7.86869131145613259100e-4,
        1.48753612908506148525e-2,
        1.36929880922735805310e-1,
        5.99832206555887937690e-1,
        1.0,
    ),
)


@compiled
def nearest(x: float) -> float:
    """Nearest integer, ties to even; for abs(x) <= 2^51."""
    return (x + _ROUNDER) - _ROUNDER


@compiled
def square(x: float) -> float:
    """Square as a single rounded product, unlike ``x**2`` on some systems."""
    return x * x


@compiled
def root(x: float, times: int) -> float:
    """Repeated square root: x^(1 / 2^times)."""
    for _ in range(times):
        x = np.sqrt(x)
    return x


@compiled
def _exact_sum(a: float, b: float) -> tuple[float, float]:
    """Rounded sum and its rounding error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@compiled
def _exact_product(a: float, b: float) -> tuple[float, float]:
    """Rounded product and its rounding error (Dekker); for magnitudes below 2^996."""
    product = a * b
    spread = _SPLITTER * a
    a_high = spread - (spread - a)
    a_low = a - a_high
    spread = _SPLITTER * b
    b_high = spread - (spread - b)
    b_low = b - b_high
    rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, rest


@compiled
def _polynomial(coefficients: tuple[float, ...], x: float) -> float:
    """Evaluates a polynomial by Horner's rule."""
    value = 0.0
    for coefficient in coefficients:
        value = value * x + coefficient
    return value


@compiled
def _ratio(polynomials: tuple[tuple[float, ...], tuple[float, ...]], x: float) -> float:
    return _polynomial(polynomials[0], x) / _polynomial(polynomials[1], x)


@compiled
def sincos(x: float) -> tuple[float, float]:
    """Sine and cosine; error below 0.8 ulp for abs(x) <= 2^30, NaN beyond.

    Args:
        x: Angle [rad].
    """
    if abs(x) <= _EIGHTH_TURN:
        return _sine(x, 0.0), _cosine(x, 0.0)
    if not abs(x) <= LARGEST_ANGLE:
        return np.nan, np.nan
    quarters, angle, rest = _reduce(x)
    sine, cosine = _sine(angle, rest), _cosine(angle, rest)
    quadrant = int(quarters) & 3
    if quadrant == 0:
        return sine, cosine
    if quadrant == 1:
        return cosine, -sine
    if quadrant == 2:
        return -sine, -cosine
    return -cosine, sine


@compiled
def _reduce(x: float) -> tuple[float, float, float]:
    """Number of quarter turns in an angle, and the remainder as a sum of two numbers."""
    quarters = nearest(x * _INVERSE_HALF_PI)
    first, first_rest = _exact_product(quarters, _HALF_PI[0])
    second, second_rest = _exact_product(quarters, _HALF_PI[1])
    left, a = _exact_sum(x - first, -first_rest)
    left, b = _exact_sum(left, -second)
    rest = (a + b) - second_rest - quarters * _HALF_PI[2]
    angle = left + rest
    return quarters, angle, (left - angle) + rest


@compiled
def _sine(x: float, rest: float) -> float:
    """Sine of x + rest for abs(x) <= pi/4."""
    z = x * x
    w = z * z
    r = (
        8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06)
        + z * w * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
    )
    cube = z * x
    return x - ((z * (0.5 * rest - cube * r) - rest) - cube * -1.66666666666666324348e-01)


@compiled
def _cosine(x: float, rest: float) -> float:
    """Cosine of x + rest for abs(x) <= pi/4."""
    z = x * x
    w = z * z
    r = z * (
        4.16666666666666019037e-02
        + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05)
    ) + w * w * (
        -2.75573143513906633035e-07
        + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)
    )
    half = 0.5 * z
    whole = 1.0 - half
    return whole + (((1.0 - whole) - half) + (z * r - x * rest))


@compiled
def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y), -pi to pi [rad]; error below 0.7 ulp.

    For coordinates that are 0 or have magnitudes from 1e-140 to 1e140. The result is 0 at the
    origin; the sign of a zero is ignored.
    """
    along, across = abs(x), abs(y)
    steep = across > along
    small, large = (along, across) if steep else (across, along)
    if large == 0.0:
        return 0.0
    centre, centre_rest, u, u_rest = _atan_parts(small, large)
    base, base_rest, sign = 0.0, 0.0, 1.0
    if steep:
        base, base_rest = _HALF_PI[0], _HALF_PI[1]
        sign = 1.0 if x < 0.0 else -1.0
    elif x < 0.0:
        base, base_rest, sign = _PI[0], _PI[1], -1.0
    total, a = _exact_sum(base, sign * centre)
    total, b = _exact_sum(total, sign * u)
    angle = total + (a + b + base_rest + sign * (centre_rest + u_rest))
    return -angle if y < 0.0 else angle


@compiled
def _atan_parts(small: float, large: float) -> tuple[float, float, float, float]:
    """Arc tangent of small / large <= 1 as the sum of four numbers.

    With c the nearest of 0, 1/2 and 1, it is atan(c) (two numbers) plus atan(u) for
    u = (small - c large) / (large + c small) (u and a correction).
    """
    c, centre, centre_rest = 0.0, 0.0, 0.0
    if small >= 0.6875 * large:
        c, centre, centre_rest = 1.0, _ATAN_ONE[0], _ATAN_ONE[1]
    elif small >= 0.4375 * large:
        c, centre, centre_rest = 0.5, _ATAN_HALF[0], _ATAN_HALF[1]
    top = small - c * large
    bottom, bottom_rest = _exact_sum(large, c * small)
    u = top / bottom
    product, product_rest = _exact_product(u, bottom)
    lacking = ((top - product) - product_rest - u * bottom_rest) / bottom
    z = u * u
    w = z * z
    series = z * _polynomial(_ATAN_ODD, w) + w * _polynomial(_ATAN_EVEN, w)
    return centre, centre_rest, u, lacking - u * series


@compiled
def hypot(x: float, y: float) -> float:
    """Length of the vector (x, y); error below 0.501 ulp.

    For components that are 0 or have magnitudes from 1e-140 to 1e140.
    """
    a, b = abs(x), abs(y)
    large, small = (a, b) if a > b else (b, a)
    first, first_rest = _exact_product(large, large)
    second, second_rest = _exact_product(small, small)
    length = np.sqrt(first + second)
    if length == 0.0:
        return 0.0
    whole, whole_rest = _exact_product(length, length)
    excess = ((whole - first) - second) + ((whole_rest - first_rest) - second_rest)
    return length - excess / (2.0 * length)


@compiled
def exp(x: float) -> float:
    """Exponential; error below 0.9 ulp for -708 <= x <= 709, 0 below and infinite above."""
    if x < LEAST_EXPONENT:
        return 0.0
    if x > LARGEST_EXPONENT:
        return np.inf
    if not abs(x) <= LARGEST_EXPONENT:
        return np.nan
    power = nearest(x * _INVERSE_LN2)
    high, low = x - power * _LN2[0], power * _LN2[1]
    r = high - low
    z = r * r
    c = r - z * _polynomial(_EXP, z)
    value = 1.0 - ((low - (r * c) / (2.0 - c)) - high)
    scale = np.int64((int(power) + _EXPONENT_BIAS) << _MANTISSA_BITS)
    return value * scale.view(np.float64)


@compiled
def log(x: float) -> float:
    """Natural logarithm; error below 0.9 ulp for positive normal numbers, otherwise NaN."""
    if not LEAST_NORMAL <= x <= LARGEST_NORMAL:
        return np.nan
    bits = np.float64(x).view(np.int64)
    power = (bits >> _MANTISSA_BITS) - _EXPONENT_BIAS
    mantissa = np.int64((bits & _MANTISSA) | (_EXPONENT_BIAS << _MANTISSA_BITS)).view(np.float64)
    if mantissa > 1.4142135623730951:
        mantissa, power = 0.5 * mantissa, power + 1
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    r = w * _polynomial(_LOG_EVEN, w) + z * _polynomial(_LOG_ODD, w)
    half = 0.5 * f * f
    return power * _LN2[0] - ((half - (s * (half + r) + power * _LN2[1])) - f)


@compiled
def inverse_normal(p: float) -> float:
    """Quantile of the standard normal distribution; error below 8 ulp for 0 < p < 1."""
    q = p - 0.5
    if abs(q) <= 0.425:
        return q * _ratio(_CENTRE, 0.180625 - q * q)
    root = np.sqrt(-log(min(p, 1.0 - p)))
    size = _ratio(_NEAR_TAIL, root - 1.6) if root <= 5.0 else _ratio(_FAR_TAIL, root - 5.0)
    return -size if q < 0.0 else size
