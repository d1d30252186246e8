"""Friction that fits the forces it changes, where exchanging one for the other does not settle.

A joint's friction φ = −a·|P + Qφ|, with a = ±μ r by its sense, changes its own force P + Qφ. Put in again and again it
settles where the joints gain less than 1 on the way round; a mechanism that is stiff against its input gains more though
it moves. Here the coefficients grow from none, and Newton's method follows the friction (a homotopy: E. L. Allgower,
K. Georg, Introduction to Numerical Continuation Methods, SIAM, 2003, ch. 2). Where the determinant comes to zero on the
way, two solutions meet and end: beyond it no force balances its own friction, and the joints lock.
"""

from __future__ import annotations

import numpy as np

from virtualwork.formulas.numbers import EPS, Complexes, Reals

# shares of the coefficients by which they grow, first and at least; steps of Newton's method at each
FIRST, LEAST, NEWTONS = 0.25, 1e-4, 12


def balanced(arms: Reals, p: Complexes, q: Complexes) -> Reals | None:
    """The friction φ of joints, φ = −arms·|p + q·φ|; None where they lock.

    Parameters
    ----------
    arms : array (c,)
        The largest friction over the force of each joint, with the sign of its rate.
    p : array (c,)
        The forces without friction; of guides the normal one, a real number.
    q : array (c, c)
        What each friction adds to them.

    Examples
    --------
    A force 1 + 3φ that its own friction unloads, which putting it in again and again makes ever larger:

    >>> balanced(np.array([1.0]), np.array([1 + 0j]), np.array([[3 + 0j]])).tolist()
    [-0.25]

    One that it loads by as much locks:

    >>> balanced(np.array([-1.0]), np.array([1 + 0j]), np.array([[3 + 0j]])) is None
    True
    """
    phi, share, step = np.zeros(len(arms)), 0.0, FIRST
    while share < 1.0:
        ahead = min(1.0, share + step)
        followed = _followed(phi, ahead * arms, p, q)
        if followed is None:
            step = 0.5 * step
            if step < LEAST:
                return None
            continue
        phi, share, step = followed, ahead, 2.0 * step
    return phi


def _followed(phi: Reals, arms: Reals, p: Complexes, q: Complexes) -> Reals | None:
    """Newton's method from the friction at smaller coefficients; None where it does not stay on the way."""
    last = np.inf
    for _ in range(NEWTONS):
        force = p + q @ phi
        size = np.abs(force)
        if not np.isfinite(size).all() or not size.all():
            return None
        jacobian = np.eye(len(arms)) + (arms / size)[:, None] * (force.conj()[:, None] * q).real
        if not np.linalg.det(jacobian) > 0:
            return None
        step = np.linalg.solve(jacobian, phi + arms * size)
        phi = phi - step
        # relative to each joint's largest friction
        change = float(np.max(np.abs(step) / (np.abs(arms) * size + np.abs(phi) + np.finfo(float).tiny)))
        if change <= 8 * EPS or (change < 1e-9 and change >= 0.5 * last):
            return phi
        last = change
    return None
