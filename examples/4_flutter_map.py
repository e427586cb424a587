"""
A flutter map
=============

How the motion ends for every airspeed and initial pitch: run 102 of the thesis, figure 5.12a.
"""

import numpy as np

from aeroflutter import load_case
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.plots.maps import plot_map
from aeroflutter.studies.maps import Axis, Grid, SpeedPitch, flutter_map

case = load_case("run102")
grid = Grid(
    Axis("speed_ratio", np.linspace(0.5, 0.99, 100)),
    Axis("initial.alpha_deg", np.linspace(1.0, 15.0, 60)),
)
found = flutter_map(SpeedPitch(case.family(), case.spring, grid, flutter_speed(case.family())))
print({state: found.count(state) for state in ("damped", "lco", "aperiodic", "undecided")})
figure = plot_map(found, "run 102")
