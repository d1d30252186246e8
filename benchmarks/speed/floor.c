/* The least that the arithmetic of a four-bar costs on this machine: written by hand, for the compiler's own vectors.
   l: crank, coupler, rocker, ground along x; q (n), w the speed. */
#include <math.h>
#include <stddef.h>

void position(ptrdiff_t n, const double *restrict q, const double *restrict l, double *restrict x, double *restrict y)
{
    const double outer = l[1] + l[2], inner = l[1] - l[2];
    for (ptrdiff_t i = 0; i < n; i++) {
        const double bx = l[0] * cos(q[i]), by = l[0] * sin(q[i]);
        const double u = bx - l[3], d2 = u * u + by * by, half = 0.5 / d2;
        const double a = (d2 + outer * inner) * half;
        const double h = sqrt((outer * outer - d2) * (d2 - inner * inner)) * half;
        x[i] = bx - (a * u + h * by);
        y[i] = by - (a * by - h * u);
    }
}

void rates(ptrdiff_t n, const double *restrict q, const double *restrict l, double w, double *restrict out)
{
    const double outer = l[1] + l[2], inner = l[1] - l[2];
    double *restrict t3 = out, *restrict t4 = out + n, *restrict w3 = out + 2 * n, *restrict w4 = out + 3 * n;
    double *restrict a3 = out + 4 * n, *restrict a4 = out + 5 * n;
    for (ptrdiff_t i = 0; i < n; i++) {
        const double bx = l[0] * cos(q[i]), by = l[0] * sin(q[i]);
        const double u = bx - l[3], d2 = u * u + by * by, half = 0.5 / d2;
        const double a = (d2 + outer * inner) * half;
        const double h = sqrt((outer * outer - d2) * (d2 - inner * inner)) * half;
        const double px = -(a * u + h * by), py = -(a * by - h * u);
        const double rx = px + u, ry = py + by;
        const double inverse = 1 / (px * ry - py * rx);
        const double vx = -w * by, vy = w * bx;
        /* w3·(i p) − w4·(i r) = −v */
        const double s3 = -(vx * rx + vy * ry) * inverse, s4 = -(vx * px + vy * py) * inverse;
        const double ax = -w * vy - s3 * s3 * px + s4 * s4 * rx, ay = w * vx - s3 * s3 * py + s4 * s4 * ry;
        t3[i] = atan2(py, px);
        t4[i] = atan2(ry, rx);
        w3[i] = s3;
        w4[i] = s4;
        a3[i] = -(ax * rx + ay * ry) * inverse;
        a4[i] = -(ax * px + ay * py) * inverse;
    }
}
