"""
A describing function beside the truth
======================================

At a frequency ratio of 0.8 the motion is nearly sinusoidal and the estimate good; at 0.2 it has
strong harmonics (run 102 of the thesis), and the estimate misses what happens between 0.6 and 0.8
of the flutter speed.
"""

import numpy as np

from aeroflutter import load_case
from aeroflutter.orbits.cycles import limit_cycles
from aeroflutter.orbits.describing import describing_curve
from aeroflutter.plots.amplitudes import plot_amplitudes


def both(name):
    """The two curves of a built-in case."""
    case = load_case(name)
    estimate = describing_curve(case.family(), case.spring)
    exact = limit_cycles(case.family(), case.spring)
    return plot_amplitudes(estimate, exact, (np.empty(0), np.empty(0)), name)


good = both("run14")

# %%
# And where it is not good:

poor = both("run102")
