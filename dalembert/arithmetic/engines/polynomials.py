"""Sine, cosine and arctangent as polynomials: what compiled code and the JavaScript of pages have in common.

Polynomials and reduction are those of W. J. Cody, W. Waite, Software Manual for the Elementary Functions (1980), with
the coefficients published with FDLIBM (Sun Microsystems, 1993).
"""

from __future__ import annotations

FARTHEST = 1.6e6  # just below 2²⁰·π/2: the multiple of π/2 has at most 20 bits
NEAREST = 2.0**-66  # of the multiple: nearer than this the three parts of π/2 do not hold two units
CANCELLED = 2.0**-30  # a sine or cosine so small, of a large argument, is worked out on whole numbers
SMALLEST, LARGEST = 2.0**-1000, 2.0**1000  # sizes of the larger coordinate that the arctangent takes itself

HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)
ARCTANGENT_ODD = (
    3.33333333333329318027e-01,
    1.42857142725034663711e-01,
    9.09088713343650656196e-02,
    6.66107313738753120669e-02,
    4.97687799461593236017e-02,
    1.62858201153657823623e-02,
)
ARCTANGENT_EVEN = (
    -1.99999999998764832476e-01,
    -1.11111104054623557880e-01,
    -7.69187620504482999495e-02,
    -5.83357013379057348645e-02,
    -3.65315727442169155270e-02,
)
QUARTER = (0.785398163397448279, 3.06161699786838301793e-17)
"""π/4 and its rest."""
TWO_OVER_PI = 0.63661977236758134308
STEEP = 0.41421356237309503
"""tan 22.5°: beyond it an angle is counted from 45°."""
