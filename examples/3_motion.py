"""
A motion and its end
====================

The exact engine marches until the end of the motion is certain. Here a limit cycle of run 102, with
its spring path, phase plane, spectrum and Poincaré section.
"""

from math import radians

from aeroflutter import load_case
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.motion.response import Initial, SimulateOptions, simulate
from aeroflutter.plots.timemarch import plot_response

case = load_case("run102")
system = case.family().at(0.83 * flutter_speed(case.family()))
start = Initial(alpha=radians(6.0))
end = simulate(system, case.spring, start)
print(f"{end.state}: {end.reason}")

response = simulate(system, case.spring, start, SimulateOptions(duration=2500.0, decide=False))
figure = plot_response(response, title="run 102 at 0.83 of the flutter speed")
