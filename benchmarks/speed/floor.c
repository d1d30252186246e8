/* The least that the arithmetic of a mechanism costs on this machine: written by hand, for the compiler's own vectors.
   The sine is a cosine a quarter turn on: of both at once the compiler makes one call, of one pose.
   q (n), w the speed. l: crank, coupler, rocker, ground along x. */
#include <math.h>
#include <stddef.h>

#define QUARTER 1.5707963267948966

/* The angle of x + iy, for whole vectors where the library's is of one number: S. L. Moshier's rational function for the
   arctangent (Cephes), on |t| < 0.66 once the larger part is below and 45° is taken off. */
static inline double heading(double y, double x)
{
    const double u = fabs(x), v = fabs(y), high = fmax(u, v), low = fmin(u, v);
    const double wide = low > 0.66 * high ? 1.0 : 0.0, steep = v > u ? 1.0 : 0.0, back = x < 0 ? 1.0 : 0.0;
    const double t = (low - wide * high) / (high + wide * low), z = t * t;
    const double p = (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) * z
                      - 1.228866684490136173410e2) * z - 6.485021904942025371773e1;
    const double r = ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z
                       + 4.328810604912902668951e2) * z + 4.853903996359136964868e2) * z + 1.945506571482613964425e2;
    double angle = t + t * z * p / r + wide * (0.5 * QUARTER);
    angle = steep * QUARTER + (1 - 2 * steep) * angle;
    angle = back * (2 * QUARTER) + (1 - 2 * back) * angle;
    return copysign(angle, y);
}

/* Two bars that meet, from points u = P − Q apart: the bars, their speeds and accelerations. */
typedef struct { double px, py, rx, ry, inverse, s1, s2, a1, a2; } Dyad;

static inline Dyad placed(double ux, double uy, double first, double second, double side)
{
    Dyad d;
    const double outer = first + second, inner = first - second, u2 = ux * ux + uy * uy, half = 0.5 / u2;
    const double a = (u2 + outer * inner) * half;
    const double h = side * sqrt((outer * outer - u2) * (u2 - inner * inner)) * half;
    d.px = -(a * ux + h * uy);
    d.py = -(a * uy - h * ux);
    d.rx = d.px + ux;
    d.ry = d.py + uy;
    return d;
}

/* v, a: the velocity and the acceleration of P from Q;  s1·(i p) − s2·(i r) = −v */
static inline void moved(Dyad *d, double vx, double vy, double ax, double ay)
{
    d->inverse = 1 / (d->px * d->ry - d->py * d->rx);
    d->s1 = -(vx * d->rx + vy * d->ry) * d->inverse;
    d->s2 = -(vx * d->px + vy * d->py) * d->inverse;
    const double f = d->s1 * d->s1, g = d->s2 * d->s2;
    const double x = ax - f * d->px + g * d->rx, y = ay - f * d->py + g * d->ry;
    d->a1 = -(x * d->rx + y * d->ry) * d->inverse;
    d->a2 = -(x * d->px + y * d->py) * d->inverse;
}

void position(ptrdiff_t n, const double *restrict q, const double *restrict l, double *restrict x, double *restrict y)
{
#pragma GCC ivdep
    for (ptrdiff_t i = 0; i < n; i++) {
        const double bx = l[0] * cos(q[i]), by = l[0] * cos(q[i] - QUARTER);
        const Dyad d = placed(bx - l[3], by, l[1], l[2], -1);
        x[i] = bx + d.px;
        y[i] = by + d.py;
    }
}

void rates(ptrdiff_t n, const double *restrict q, const double *restrict l, double w, double *restrict out)
{
#pragma GCC ivdep
    for (ptrdiff_t i = 0; i < n; i++) {
        const double bx = l[0] * cos(q[i]), by = l[0] * cos(q[i] - QUARTER);
        Dyad d = placed(bx - l[3], by, l[1], l[2], -1);
        moved(&d, -w * by, w * bx, -w * w * bx, -w * w * by);
        out[i] = heading(d.py, d.px);
        out[n + i] = heading(d.ry, d.rx);
        out[2 * n + i] = d.s1;
        out[3 * n + i] = d.s2;
        out[4 * n + i] = d.a1;
        out[5 * n + i] = d.a2;
    }
}

/* m, g: mass, centre (x, y in the link's axes) and inertia of crank, coupler, rocker; weight along −y; a torque on the
   rocker. out: the crank's torque, the forces at A on the crank, B on the coupler, C and D on the rocker. */
void forces(ptrdiff_t n, const double *restrict q, const double *restrict l, double w, const double *restrict m,
            double gravity, double torque, double *restrict out)
{
    const double k2 = 1 / l[0], k3 = 1 / l[1], k4 = 1 / l[2];
#pragma GCC ivdep
    for (ptrdiff_t i = 0; i < n; i++) {
        const double bx = l[0] * cos(q[i]), by = l[0] * cos(q[i] - QUARTER), wx = -w * w * bx, wy = -w * w * by;
        Dyad d = placed(bx - l[3], by, l[1], l[2], -1);
        moved(&d, -w * by, w * bx, wx, wy);
        const double c2x = (m[1] * bx - m[2] * by) * k2, c2y = (m[1] * by + m[2] * bx) * k2;
        const double c3x = (m[5] * d.px - m[6] * d.py) * k3, c3y = (m[5] * d.py + m[6] * d.px) * k3;
        const double c4x = (m[9] * d.rx - m[10] * d.ry) * k4, c4y = (m[9] * d.ry + m[10] * d.rx) * k4;
        const double s3 = d.s1 * d.s1, s4 = d.s2 * d.s2;
        const double f2x = m[0] * w * w * c2x, f2y = m[0] * (w * w * c2y - gravity);
        const double f3x = -m[4] * (wx - s3 * c3x - d.a1 * c3y), f3y = -m[4] * (wy - s3 * c3y + d.a1 * c3x + gravity);
        const double f4x = m[8] * (s4 * c4x + d.a2 * c4y), f4y = -m[8] * (d.a2 * c4x - s4 * c4y + gravity);
        const double about_d = -(torque - m[11] * d.a2 + c4x * f4y - c4y * f4x);
        const double about_b = c3x * f3y - c3y * f3x - m[7] * d.a1;
        const double cx = (about_b * d.rx - about_d * d.px) * d.inverse;
        const double cy = (about_b * d.ry - about_d * d.py) * d.inverse;
        const double b3x = cx - f3x, b3y = cy - f3y;
        out[i] = bx * b3y - by * b3x - (c2x * f2y - c2y * f2x);
        out[n + 2 * i] = b3x - f2x;
        out[n + 2 * i + 1] = b3y - f2y;
        out[3 * n + 2 * i] = b3x;
        out[3 * n + 2 * i + 1] = b3y;
        out[5 * n + 2 * i] = cx;
        out[5 * n + 2 * i + 1] = cy;
        out[7 * n + 2 * i] = -(f4x + cx);
        out[7 * n + 2 * i + 1] = -(f4y + cy);
    }
}

/* The Klann leg. k: D − A, E − A (x, y each), crank, coupler, rocker, the coupler's G (x, y), arm, leg.
   out: angle, speed and acceleration of coupler, rocker, arm, leg. */
void klann(ptrdiff_t n, const double *restrict q, const double *restrict k, double w, double *restrict out)
{
    const double along = 1 / k[5];
#pragma GCC ivdep
    for (ptrdiff_t i = 0; i < n; i++) {
        const double bx = k[4] * cos(q[i]), by = k[4] * cos(q[i] - QUARTER);
        const double vx = -w * by, vy = w * bx, ax = -w * w * bx, ay = -w * w * by;
        Dyad d = placed(bx - k[0], by - k[1], k[5], k[6], -1);
        moved(&d, vx, vy, ax, ay);
        const double gx = (k[7] * d.px - k[8] * d.py) * along, gy = (k[7] * d.py + k[8] * d.px) * along;
        const double s = d.s1 * d.s1;
        /* the leg from G, the arm from E */
        Dyad e = placed(bx + gx - k[2], by + gy - k[3], k[10], k[9], 1);
        moved(&e, vx - d.s1 * gy, vy + d.s1 * gx, ax - s * gx - d.a1 * gy, ay - s * gy + d.a1 * gx);
        out[i] = heading(d.py, d.px);
        out[n + i] = d.s1;
        out[2 * n + i] = d.a1;
        out[3 * n + i] = heading(d.ry, d.rx);
        out[4 * n + i] = d.s2;
        out[5 * n + i] = d.a2;
        out[6 * n + i] = heading(e.ry, e.rx);
        out[7 * n + i] = e.s2;
        out[8 * n + i] = e.a2;
        /* the leg's axis runs from F to G */
        out[9 * n + i] = heading(-e.py, -e.px);
        out[10 * n + i] = e.s1;
        out[11 * n + i] = e.a1;
    }
}
