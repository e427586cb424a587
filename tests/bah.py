"""The BAH wing: forces as Nastran wrote them (tests/data, from the models of pyNastran, BSD-3).

MKAERO1 cards give Mach 0, then 0.2, at the first eight reduced frequencies, then likewise at the
other seven.
"""

from pathlib import Path

import numpy as np

from aeroflutter.model.elsewhere.forces import TabulatedForces
from aeroflutter.model.elsewhere.modal import Modes
from aeroflutter.model.elsewhere.op4 import read_op4

FILE = Path(__file__).parent / "data" / "bah_plane_qhh.op4"
CARDS = ([0.001, 0.05, 0.1, 0.2, 0.5, 1.0, 1.2, 1.5], [2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0])
K = [k for card in CARDS for _ in range(2) for k in card]
MACH = [mach for card in CARDS for mach in (0.0, 0.2) for _ in card]
EIGENVALUES = [
    0.0, 0.0, 237.7467, 556.3491, 2989.911, 3199.282, 8308.047, 19385.00, 67106.59, 126280.9,
]  # fmt: skip
MODEL = {
    "kind": "modal",
    "file": str(FILE),
    "semichord": 2.0,
    "density": 1.225,
    "k": K,
    "mach": MACH,
    "at_mach": 0.2,
    "M": [1.0] * 10,
    "K": EIGENVALUES,
    "speed_range": [100.0, 700.0],
    "lags": 4,
    "exact": [0.1],
}


def modes() -> Modes:
    """The wing at Mach 0.2."""
    matrices = [matrix for _, matrix in read_op4(FILE)]
    chosen = [i for i, mach in enumerate(MACH) if mach == 0.2]
    forces = TabulatedForces(
        np.array([K[i] for i in chosen]), np.array([matrices[i] for i in chosen])
    )
    return Modes(
        mass=np.ones(10),
        stiffness=np.array(EIGENVALUES),
        forces=forces,
        semichord=2.0,
        density=1.225,
    )
