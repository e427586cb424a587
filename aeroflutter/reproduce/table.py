"""Table 5.1 with two columns more: speed ratio at which limit cycles start."""

from __future__ import annotations

from typing import Any, NamedTuple

from aeroflutter.case import load_case
from aeroflutter.orbits.cycles import limit_cycles
from aeroflutter.orbits.describing import describing_curve

__all__ = ["THESIS", "Row", "onset_table", "rows"]

# B. Brooking 1998, Table 5.1: run, describing function, finite difference (Houbolt).
THESIS: tuple[tuple[int, float, float], ...] = (
    (6, 0.942, 0.830),
    (10, 0.824, 0.852),
    (14, 0.942, 0.922),
    (15, 0.969, 0.954),
    (16, 0.801, 0.816),
    (100, 0.187, 0.136),
    (101, 0.366, 0.400),
    (102, 0.528, 0.532),
    (103, 0.726, 0.730),
    (111, 0.930, 0.910),
)


class Row(NamedTuple):
    """One run: the thesis's two numbers, and the two computed here."""

    run: int
    omega_bar: float
    thesis_df: float
    thesis_houbolt: float
    complex_df: float
    exact: float
    exact_stable: float


def rows() -> list[Row]:
    """The table; onsets that do not exist are NaN."""
    return [_row(*line) for line in THESIS]


def _row(run: int, thesis_df: float, thesis_houbolt: float) -> Row:
    case = load_case(f"run{run}")
    df = describing_curve(case.family(), case.spring).onset
    cycles = limit_cycles(case.family(), case.spring)
    exact, stable = (
        float("nan") if onset is None else onset.cycle.speed_ratio
        for onset in (cycles.onset, cycles.stable_onset)
    )
    return Row(
        run=run,
        omega_bar=case.section.omega_bar,
        thesis_df=thesis_df,
        thesis_houbolt=thesis_houbolt,
        complex_df=float("nan") if df is None else df.speed_ratio,
        exact=exact,
        exact_stable=stable,
    )


_COLUMNS = (
    "run", "ω̄", "thesis DF", "thesis Houbolt", "complex DF", "exact onset", "exact stable onset",
    "thesis DF - exact (%)", "thesis Houbolt - exact stable (%)", "complex DF - exact (%)",
)  # fmt: skip


def onset_table(title: str) -> tuple[str, dict[str, Any]]:
    """The table as Markdown, and its numbers by run."""
    found = rows()
    lines = [f"# {title}", "", _line(_COLUMNS), _line(["---"] * len(_COLUMNS))]
    for row in found:
        off = (
            _percent(row.thesis_df, row.exact),
            _percent(row.thesis_houbolt, row.exact_stable),
            _percent(row.complex_df, row.exact),
        )
        numbers = [f"{value:.3f}" for value in (row.thesis_df, row.thesis_houbolt)]
        numbers += [f"{value:.5f}" for value in (row.complex_df, row.exact, row.exact_stable)]
        lines.append(_line([str(row.run), f"{row.omega_bar:g}", *numbers, *off]))
    facts = {f"run {row.run}": [row.complex_df, row.exact, row.exact_stable] for row in found}
    return "\n".join(lines) + "\n", facts


def _percent(value: float, reference: float) -> str:
    return f"{100 * (value / reference - 1):+.2f}"


def _line(cells: Any) -> str:
    return f"| {' | '.join(cells)} |"
