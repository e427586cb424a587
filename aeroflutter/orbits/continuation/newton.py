"""Newton's method onto a curve, its tangent, and its branch points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from aeroflutter.errors import ConvergenceError
from aeroflutter.orbits.continuation.problem import Array, ContinuationOptions, Problem, Scale, Test


def correct(
    problem: Problem,
    x: ArrayLike,
    direction: ArrayLike | None = None,
    options: ContinuationOptions | None = None,
) -> tuple[Array, int]:
    """Newton's method onto the curve, in the hyperplane through `x` normal to `direction`.

    Without a direction every update is the shortest one (Gauss-Newton).

    Returns
    -------
    x, iterations

    Raises
    ------
    ConvergenceError
        After `max_newton` iterations, or where the problem is undefined or singular.
    """
    options = options or ContinuationOptions()
    scale = scale_of(x, options)
    point = np.array(x, dtype=float)
    for iteration in range(1, options.max_newton + 1):
        update = _newton_update(problem, point, direction, scale)
        with np.errstate(over="ignore"):  # a step out of all bounds is no error of arithmetic
            size, unit = np.linalg.norm(update), 1.0 + np.linalg.norm(point / scale)
        if not np.isfinite(size):
            break
        if size <= options.settled * unit:  # as it is: what is known there need not be found again
            return point, iteration
        point = point + scale * update
        if size <= options.tolerance * unit:
            return point, iteration
    raise ConvergenceError("Newton's method did not converge", point, f" near x = {show(x)}")


def tangent_at(problem: Problem, x: Array, along: Array | None = None, scale: Scale = 1.0) -> Array:
    """Unit tangent at a point of the curve, on the side of `along` where it is given."""
    try:
        if along is None:
            vector = np.linalg.svd(problem.jacobian(x) * scale)[2][-1]
        else:
            vector = np.linalg.solve(_bordered(problem, x, along, scale), np.eye(x.size)[-1])
    except np.linalg.LinAlgError:
        raise ConvergenceError(f"the curve has no tangent at x = {show(x)}", x) from None
    return np.asarray(scale * vector / np.linalg.norm(vector))


def branch_test(problem: Problem, scale: Scale = 1.0) -> Test:
    """Test function whose simple zeros are branch points: det of Jacobian and tangent."""
    return lambda x, tangent: float(np.linalg.det(_bordered(problem, x, tangent, scale)))


def branch_direction(problem: Problem, x: Array, tangent: Array, scale: Scale = 1.0) -> Array:
    """At a simple branch point, the direction in the Jacobian's null space across the tangent.

    At a symmetric pitchfork it is the tangent of the other branch; elsewhere a start for it.
    """
    return np.asarray(scale * np.linalg.svd(_bordered(problem, x, tangent, scale))[2][-1])


def _bordered(problem: Problem, x: Array, row: Array, scale: Scale) -> Array:
    return np.vstack((problem.jacobian(x) * scale, row / scale))


def scale_of(x: ArrayLike, options: ContinuationOptions) -> Array:
    """Size of every unknown, of the shape of x."""
    return np.broadcast_to(np.asarray(options.scale, dtype=float), np.shape(x))


def _newton_update(
    problem: Problem, point: Array, direction: ArrayLike | None, scale: Array
) -> Array:
    """Scaled Newton update; not finite where the problem is."""
    residual, jacobian = problem.residual(point), problem.jacobian(point) * scale
    if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
        return np.full(point.shape, np.nan)
    try:
        if direction is None:
            return np.asarray(-np.linalg.lstsq(jacobian, residual)[0])
        row = np.asarray(direction, dtype=float) * scale
        matrix, right = np.empty((point.size, point.size)), np.zeros(point.size)
        matrix[:-1], matrix[-1], right[:-1] = jacobian, row / np.linalg.norm(row), -residual
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.full(point.shape, np.nan)


def show(x: ArrayLike) -> str:
    """A point for messages."""
    return "(" + ", ".join(f"{value:.6g}" for value in np.asarray(x, dtype=float)) + ")"
