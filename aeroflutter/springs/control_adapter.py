"""Springs as describing-function nonlinearities of python-control.

python-control takes over a second to import, so this module is imported only by who wants it.
"""

from __future__ import annotations

import control
import numpy as np

from aeroflutter.springs.base import Spring

__all__ = ["SpringNonlinearity"]


class SpringNonlinearity(control.DescribingFunctionNonlinearity):
    """A spring for ``control.describing_function`` and ``describing_function_response``.

    Parameters
    ----------
    spring : Spring
        Its describing function is the closed form without bias; called with samples it carries
        its memory along, as python-control's protocol of one sample a call demands.
    """

    def __init__(self, spring: Spring) -> None:
        super().__init__()
        self.spring = spring
        self._memory: float | None = None

    def __call__(self, alpha: float) -> float:
        """Moment (radians) at the next sample of pitch."""
        before = self.spring.initial_memory(alpha) if self._memory is None else self._memory
        self._memory = float(self.spring.advance(before, alpha))
        return float(self.spring.moment(alpha, self._memory))

    def _isstatic(self) -> bool:
        return not np.any(self.spring.advance(0.0, np.array([1e3, -1e3]) * self.spring.scale))

    def describing_function(self, amplitude: float) -> complex:
        """N(A) in closed form."""
        return complex(self.spring.describing(amplitude, 0.0).N)
