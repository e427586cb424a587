"""The two ways in which an analysis refuses: the input is wrong, or the method did not converge."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = ["AeroflutterError", "ConvergenceError", "InputError"]


class AeroflutterError(Exception):
    """Base of every error that this package raises on purpose."""


class InputError(AeroflutterError):
    """Input that cannot be used; the command line ends with exit code 2.

    Parameters
    ----------
    problems
        One line a problem, each naming the field, what it holds and the remedy. A single
        string counts as one problem.
    """

    problems: tuple[str, ...]

    def __init__(self, problems: Sequence[str] | str) -> None:
        listed = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__(listed)
        self.problems = listed

    def __str__(self) -> str:
        return "\n".join(self.problems)


class ConvergenceError(AeroflutterError):
    """A method that did not converge; the command line ends with exit code 3.

    Parameters
    ----------
    reason
        What did not converge, and what was kept.
    partial
        Whatever was computed before, so that it is not lost.
    where
        The point at which, where it says more than the caller knows: the message ends with it.
    """

    reason: str
    partial: Any

    def __init__(self, reason: str, partial: Any = None, where: str = "") -> None:
        super().__init__(reason, partial, where)
        self.reason, self.partial, self._where = reason, partial, where

    def __str__(self) -> str:
        return self.reason + self._where
