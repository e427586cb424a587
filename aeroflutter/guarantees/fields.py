"""A guarantee as plain values, for the command line."""

from __future__ import annotations

from typing import Any

import numpy as np

from aeroflutter.guarantees.verdict import Guarantees

__all__ = ["guarantee_fields"]


def guarantee_fields(found: Guarantees, i: int, unit: float | None = None) -> dict[str, Any]:
    """Point `i`: its bands, or the reason why there are none.

    Parameters
    ----------
    unit
        Linear flutter speed U*_L, for `speed_ratio`.
    """
    proved = bool(found.guaranteed[i])
    speed = found.speed[i].tolist() if proved else None
    amplitude = np.degrees(found.amplitude[i])
    error = float(found.expected_error[i])
    return {
        "guaranteed": proved,
        "reason": found.reason[i] or None,
        "method": found.method[i] or None,
        "speed": speed,
        "speed_ratio": [value / unit for value in speed] if speed and unit else None,
        "k": found.omega[i].tolist() if proved else None,
        "amplitude_deg": amplitude.tolist() if np.all(np.isfinite(amplitude)) else None,
        "exists_at_speed": bool(found.exists_at_speed[i]),
        "harmonics_deg": float(np.degrees(found.rest[i])) if proved else None,
        "contraction_ratio": float(found.ratio[i]),
        "expected_error": error,
        "doubtful": bool(found.doubtful[i]),
    }
