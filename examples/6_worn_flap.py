"""
A worn flap hinge
=================

The wing of Conner, Tang, Dowell and Virgin (1997), with freeplay in the hinge of its flap. Limit
cycles begin at less than a fifth of the flutter speed, and many of them exist at one speed.
"""

import numpy as np

import aeroflutter as af

case = af.load_case("conner")
cycles = af.limit_cycles(case, options=af.CycleOptions(simulations=0, depth=0))
print(f"flutter at {case.scale.velocity(cycles.flutter_speed):.2f} m/s with a tight hinge")
figure = cycles.plot()

# %%
# One of the motions:

motion = af.simulate(case, velocity=6.0)
print(f"{motion.state}, flap {np.degrees(motion.amplitude):.2f} deg")
trace = motion.plot()
