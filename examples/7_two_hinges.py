"""
Two worn hinges at once
=======================

Freeplay in pitch and in the hinge of the flap; each spring moves on its own.
"""

import aeroflutter as af

case = af.load_case(
    {
        "title": "two worn hinges",
        "section": {"omega_bar": 0.6, "zeta_xi": 0.01, "zeta_alpha": 0.01},
        "flap": {"hinge": 0.5, "x_beta": 0.0125, "r_beta": 0.08, "omega_beta": 4.0},
        "spring": [
            {"at": "pitch", "kind": "freeplay", "gap_deg": 0.5},
            {"at": "flap", "kind": "freeplay", "gap_deg": 1.0},
        ],
        "initial": {"alpha_deg": 3.0},
    }
)
motion = af.simulate(case, speed_ratio=0.7)
print(motion.state, [f"{one.name} {one.amplitude:.4g}" for one in motion.coordinates])
figure = motion.plot()

# %%
# How motions end over both gaps, at 0.7 of the flutter speed:

ends = af.flutter_map(
    case,
    speed_ratio=[0.5, 0.6, 0.7, 0.8, 0.9, 0.95],
    alpha_deg=[0.3, 0.6, 1.0, 2.0, 3.0, 5.0],
)
regions = ends.plot()
