"""`aeroflutter onset`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from aeroflutter.cli.chart import charted
from aeroflutter.cli.common import (
    CaseName,
    CaseOptions,
    Output,
    flutter_facts,
    say,
    show_facts,
    target_problems,
)
from aeroflutter.cli.varying import Vary, onset_row
from aeroflutter.errors import InputError
from aeroflutter.results.unit import spoken_unit, told

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from aeroflutter.case import Case
    from aeroflutter.guarantees.onset import Onset
    from aeroflutter.model.section import Scale
    from aeroflutter.orbits.cycles import CycleOnset
    from aeroflutter.studies.vary import Member


def onset(
    case: CaseName,
    *,
    any_load: Annotated[
        bool,
        Parameter(
            name="--any-load",
            negative=(),
            show_default=False,
            help="What is free whatever the steady load, and no cycle, since those move with it.",
        ),
    ] = False,
    chart: Annotated[
        str | None,
        Parameter(
            help="Instead: the friction over gap, delta_v / delta_h, that is needed at speed "
            "ratios A:B:N or a,b,c (or velocity=A:B:N), by proof and by exact limit cycles."
        ),
    ] = None,
    certificate: Annotated[
        Path | None,
        Parameter(name="--certificate", help="Save the proof in this JSON file."),
    ] = None,
    vary: Vary = Vary(),
    options: CaseOptions = CaseOptions(),
    output: Output = Output(),
) -> None:
    """Where oscillation begins: free below a speed by proof, and the lowest limit cycle.

    Below the first speed nothing oscillates, whatever the start, the starting memory and the
    steady load; every frequency and every speed is covered by a separate checker in exact and
    interval arithmetic. At the second an exact limit cycle has been found. Between them is what
    is not known.
    """
    from aeroflutter.guarantees.onset import onset as find

    output.check()
    problems = target_problems("--certificate", certificate, (".json",))
    if problems:
        raise InputError(problems)
    loaded = options.load(case)
    if certificate is not None and (chart or vary.vary) is not None:
        raise InputError("--certificate: is of one case; leave out --chart and --vary")
    if chart is not None:
        if any_load or vary.vary is not None:
            raise InputError("--chart: excludes --any-load and --vary")
        charted(loaded, chart, output)
        return

    def analyse(one: Case) -> Onset:
        return find(*one.loop(), any_load=any_load)

    if vary.vary is not None:
        vary.deliver(loaded, "onset", analyse, output, rows=_row)
        return
    scale = output.begin(loaded, "onset")
    result = analyse(loaded)
    try:
        output.result(
            loaded,
            lambda: result,
            text=lambda: _print(loaded, result, scale),
            figure=lambda: _figure(loaded, result, scale),
            command="onset",
        )
    finally:  # neither takes the other with it
        proof = result.free or (result.free_at and result.free_at[1])
        if certificate is not None and proof and proof.certificate:
            proof.certificate.save(certificate)


def _row(member: Member, scale: Scale | None) -> dict[str, Any]:
    """What a member comes to: the end of what is proved free, and the lowest cycle."""
    from aeroflutter.results import fields_of

    fields = fields_of(member.result, member.case)
    free, cycle = fields["proved_free_below"], fields["lowest_cycle"]
    return {
        "proved free up to": free and free["speed_ratio"],
        "certified": free and free["certified"],
    } | {f"lowest cycle: {name}": one for name, one in onset_row(cycle, scale).items()}


def _print(case: Case, result: Onset, scale: Scale | None) -> None:
    say(case.title)
    divergence = result.linear.divergence
    facts: dict[str, Any] = flutter_facts(result.flutter_speed, scale)
    if divergence is not None:
        si = f" ({scale.velocity(divergence):.5g} m/s)" if scale else ""
        facts["divergence U*"] = f"{divergence:.6g}{si}"
    facts["proved free"] = _proved(result, scale)
    facts["lowest cycle"] = _cycle(result.lowest, scale)
    facts["lowest stable cycle"] = _cycle(result.lowest_stable, scale)
    if result.gap is not None:
        facts["between"] = f"{100.0 * result.gap:.3g} % of the speed of the lowest cycle"
    show_facts(facts)
    for note in result.notes:
        say(f"note: {note}")


def _proved(result: Onset, scale: Scale | None) -> str | None:
    from aeroflutter.results.proofs import alone_words, free_words

    if result.free_at is not None:
        speed, proof = result.free_at
        return alone_words(speed, proof.certified, result.flutter_speed, scale)
    if result.free is None or result.free_below is None:
        return None
    return free_words(result.free, result.flutter_speed, scale)


def _cycle(found: CycleOnset | None, scale: Scale | None) -> str | None:
    if found is None:
        return None
    cycle = found.cycle
    where = spoken_unit().words(f"U*/U*_L = {cycle.speed_ratio:.6f}")
    if not math.isfinite(cycle.speed_ratio):
        where = f"{spoken_unit().speed} = {cycle.speed:.6f}"
    if scale is not None:
        where = f"{scale.velocity(cycle.speed):.5g} m/s, {where}"
    return f"{where} at {told(cycle.amplitude):.5g} {spoken_unit().name} ({found.kind})"


def _figure(case: Case, result: Onset, scale: Scale | None) -> Figure:
    from aeroflutter.plots.onset import plot_onset
    from aeroflutter.plots.style import literal

    return plot_onset(result, literal(case.title), scale)
