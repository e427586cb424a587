"""
A wing from Nastran
===================

The BAH wing: generalised masses, stiffness and the air forces that Nastran wrote, with a worn hinge
put into its fourth mode. The p-k method on the table itself stands beside the approximation.
"""

from pathlib import Path

import aeroflutter as af

file = Path("../tests/data/bah_plane_qhh.op4").resolve()
cards = ([0.001, 0.05, 0.1, 0.2, 0.5, 1.0, 1.2, 1.5], [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0])
case = af.load_case(
    {
        "title": "BAH wing",
        "model": {
            "kind": "modal",
            "file": str(file),
            "semichord": 2.0,
            "density": 1.225,
            "k": [k for card in cards for _ in range(2) for k in card],
            "mach": [mach for card in cards for mach in (0.0, 0.2) for _ in card],
            "at_mach": 0.2,
            "M": [1.0] * 10,
            "K": [
                *(0.0, 0.0, 237.7467, 556.3491, 2989.911),
                *(3199.282, 8308.047, 19385.0, 67106.59, 126280.9),
            ],
            "speed_range": [100.0, 700.0],
            "lags": 4,
            "exact": [0.1],
        },
    }
)
locus = af.root_locus(case)
print(f"flutter at {locus.flutter.speed:.1f} m/s; Nastran prints 394.0")
figure = locus.plot()
