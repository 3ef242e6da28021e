r"""
Integrate bonds that are given by functions, for the judge, by collocation at Gauss points.

Accelerations at the eight Gauss points c of a step h are found by iteration, :math:`s(c_i) = s_0 +
h c_i s_0' + h^2 \sum_j \int_0^{c_i} (c_i - u) L_j(u) du\, s''(c_j)`: order 16 where the force is
smooth. The step is so small that the last two Legendre coefficients of the acceleration and the
error of its polynomial at both ends of the step are negligible. Kinks of the force are therefore
resolved, too. The first root of the polynomial of particle 1 is found as for the Taylor series; the
step is then repeated up to this root.
"""

import numpy as np
from numba import njit

from tests.judge import steps
from tests.judge.steps import BROKEN, DONE, MORE, RESTING, first_root

POINTS = 8
_LONGEST_STEP = 50.0
_ITERATIONS = 40


def _rule():
    """Return the nodes, and the matrices that turn accelerations at the nodes into a step."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    c = 0.5 * (nodes + 1.0)
    powers = np.arange(POINTS)
    monomials = np.linalg.inv(c[:, None] ** powers)
    twice = c[:, None] ** (powers + 2) / ((powers + 1) * (powers + 2)) @ monomials
    at_end = (1.0 / ((powers + 1) * (powers + 2))) @ monomials
    legendre = np.polynomial.legendre.legvander(nodes, POINTS - 1).T * (0.5 * weights)
    legendre *= (2 * powers + 1)[:, None]
    # These weights give the polynomial at the start and at the end of the step from its values at
    # the nodes.
    edges = np.array([monomials[0], monomials.sum(axis=0)])
    return c, 0.5 * weights, twice, at_end, monomials, legendre, edges


_C, _B, _TWICE, _AT_END, _MONOMIALS, _LEGENDRE, _EDGES = _rule()


@njit(error_model="numpy")
def _solve(force, h, s, v, speed, a, new, stage):
    """Iterate the accelerations of a step; return whether they converge."""
    bonds = s.size
    before = np.inf
    for _ in range(_ITERATIONS):
        change = 0.0
        for i in range(POINTS):
            for k in range(bonds):
                bend = 0.0
                for j in range(POINTS):
                    bend += _TWICE[i, j] * (a[j, k + 1] - a[j, k])
                stage[k] = -force(s[k] + h * (_C[i] * (v[k + 1] - v[k]) + h * bend))
            for k in range(bonds + 1):
                left = stage[k - 1] if k > 0 else 0.0
                right = stage[k] if k < bonds else 0.0
                new[i, k] = right - left
                difference = abs(new[i, k] - a[i, k])
                if not difference <= 1e300:
                    return False
                change = max(change, difference)
        a[:] = new
        change *= h / speed
        # The iteration stops below rounding of the velocities, or when the force no longer
        # improves.
        if change <= 1e-17 or (change <= 1e-13 and change >= 0.5 * before):
            return True
        before = change
    return False


@njit(error_model="numpy")
def _rest(force, h, s, v, a, stage):
    """
    Return the largest acceleration that the polynomials do not resolve.

    These are the last two Legendre coefficients, and the errors of the polynomials at both ends of
    the step, where no node would detect a kink.
    """
    bonds = s.size
    rest = 0.0
    for edge in range(2):
        for k in range(bonds):
            bend = 0.0
            if edge == 1:
                for j in range(POINTS):
                    bend += _AT_END[j] * (a[j, k + 1] - a[j, k])
                bend = h * (v[k + 1] - v[k] + h * bend)
            stage[k] = -force(s[k] + bend)
        for k in range(bonds + 1):
            left = stage[k - 1] if k > 0 else 0.0
            right = stage[k] if k < bonds else 0.0
            miss, last = left - right, 0.0
            for j in range(POINTS):
                miss += _EDGES[edge, j] * a[j, k]
                last += _LEGENDRE[POINTS - 1 - edge, j] * a[j, k]
            rest = max(rest, abs(miss), abs(last))
    return rest


@njit(error_model="numpy")
def _advance(force, tolerance, speed, state, s, v, basis, horizon, hits, limit):
    particles = v.size
    a, new = np.zeros((POINTS, particles)), np.zeros((POINTS, particles))
    stage = np.zeros(particles)
    path = np.zeros(POINTS + 2)
    stack, ends = np.zeros((48, POINTS + 2)), np.zeros((48, 2))
    x, t, h, last = state[0], state[1], state[2], state[3]
    found = 0
    ended = MORE
    for _ in range(limit):
        if found == hits.shape[0]:
            break
        if x == 0.0 and v[0] < 0.0:
            hits[found, 0], hits[found, 1] = t, -v[0]
            found += 1
            v[0] = -v[0]
            last = t
        if x == 0.0 and v[0] == 0.0 and particles > 1 and force(s[0]) > 0.0:
            ended = RESTING
            break
        if t >= max(horizon[0] * last, horizon[1]):
            ended = DONE
            break
        if not h > 1e-250 or t + h == np.inf:
            ended = BROKEN
            break
        a[:] = 0.0
        state[4] += 1.0
        if not _solve(force, h, s, v, speed, a, new, stage):
            h *= 0.3
            continue
        rest = _rest(force, h, s, v, a, stage) * h / speed
        if rest > tolerance:
            h *= max(0.2, 0.8 * (tolerance / rest) ** (1.0 / POINTS))
            continue
        growth = min(3.0, 0.9 * (tolerance / max(rest, 1e-30)) ** (1.0 / POINTS))
        following = min(h * growth, _LONGEST_STEP)
        path[0], path[1] = x, h * v[0]
        for k in range(POINTS):
            coefficient = 0.0
            for j in range(POINTS):
                coefficient += _MONOMIALS[k, j] * a[j, 0]
            path[k + 2] = h * h * coefficient / ((k + 1) * (k + 2))
        start = 1 if x == 0.0 else 0
        degree = POINTS + 1 - start
        root = first_root(path[start:], degree, basis[start], stack, ends)
        step = h * min(root, 1.0)
        for _ in range(6):
            if root > 1.0:
                break
            # The end of a step is more exact than its polynomial, so a step ends at the wall.
            if not _solve(force, step, s, v, speed, a, new, stage):
                ended = BROKEN
                break
            place, pace = x + step * v[0], v[0]
            for j in range(POINTS):
                place += step * step * _AT_END[j] * a[j, 0]
                pace += step * _B[j] * a[j, 0]
            if pace == 0.0 or abs(place / pace) <= 1e-16 * max(t, h) or abs(place / pace) > 0.1 * h:
                break
            step -= place / pace
        if ended == BROKEN:
            break
        for k in range(particles - 1):
            bend = 0.0
            for j in range(POINTS):
                bend += _AT_END[j] * (a[j, k + 1] - a[j, k])
            s[k] += step * (v[k + 1] - v[k] + step * bend)
        bend = 0.0
        for j in range(POINTS):
            bend += _AT_END[j] * a[j, 0]
        x = 0.0 if root <= 1.0 else x + step * (v[0] + step * bend)
        for k in range(particles):
            push = 0.0
            for j in range(POINTS):
                push += _B[j] * a[j, k]
            v[k] += step * push
        t += step
        h = following
        if root <= 1.0 and v[0] > 0.0:
            v[0] = -v[0]
    state[0], state[1], state[2], state[3] = x, t, h, last
    return ended, found


def advance(force, tolerance, speed, state, s, v, horizon, hits, limit):
    """Integrate like ``steps.advance``, with a compiled scalar force -U'(s)."""
    degree = POINTS + 1
    basis = np.zeros((2, degree + 1, degree + 1))
    basis[0] = steps.bernstein_basis(degree)
    basis[1, :degree, :degree] = steps.bernstein_basis(degree - 1)
    return _advance(force, tolerance, speed, state, s, v, basis, horizon, hits, limit)
