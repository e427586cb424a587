"""Source of ``generated/switched.py``."""

from __future__ import annotations

from types import SimpleNamespace

import sympy as sp

from derive import describing as d
from derive import switched as w
from derive.describing_module import emitted_form
from derive.emit import render
from derive.printer import source


def _emitted(values: dict[str, sp.Expr]) -> SimpleNamespace:
    parts = dict(values)
    return emitted_form(d.Harmonics(*(parts.pop(name) for name in ("F0", "n_p", "n_q"))), parts)


def switched_module() -> str:
    """Source of ``generated/switched.py``."""
    return render(
        "switched.py.j2",
        means=[source(mean) for mean in w.power_means(w.HIGHEST + 1)],
        highest=w.HIGHEST,
        relay=_emitted(w.form(w.relay_segments(), w.relay_gammas(), (d.BIAS, w.WIDTH))),
        play=_emitted(w.form(w.play_segments(), w.play_gammas(), (d.DELTA_V,))),
        friction=_emitted(w.form(w.friction_segments(), {})),
    )
