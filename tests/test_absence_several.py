"""Absence of oscillation with several springs: against one spring, and against marching."""

import numpy as np
import pytest

from aeroflutter import TypicalSection, load_case
from aeroflutter.guarantees.absence import Several, absence_at, several_at
from aeroflutter.linear.rootlocus import flutter_speed
from aeroflutter.model.family import SectionModel
from aeroflutter.motion.endstates import end_states
from aeroflutter.motion.flow import Flow
from aeroflutter.motion.response import STATES
from aeroflutter.springs import Bilinear, Hysteresis

CASE = load_case("run14")
FLUTTER = flutter_speed(CASE.family())
BOTH = SectionModel(TypicalSection(omega_bar=0.8), springs=("pitch", "heave"))
HALF = Bilinear(0.0, 0.5, -0.005, 0.01)  # half the slope inside a gap of 0.01 semi-chords


def test_of_one_spring_it_says_what_the_certified_search_says():
    system = CASE.family().at(0.9 * FLUTTER).system
    needed = 5.0 * several_at(system, [Hysteresis(1.0, 0.2)]).needed
    assert absence_at(CASE.family(), Hysteresis(1.02 * needed, 1.0), 0.9 * FLUTTER).certified
    assert not absence_at(CASE.family(), Hysteresis(0.95 * needed, 1.0), 0.9 * FLUTTER).certified


def test_run_14_with_a_gap_in_heave_against_marching():
    """At 0.85 the friction over gap that is needed is 3.9; motion goes on at 3.2, rests at 4.0."""
    system = BOTH.at(0.85 * FLUTTER)
    found = several_at(system, [Hysteresis(1.0, 0.25), HALF])
    assert 4.0 * found.needed == pytest.approx(3.9, rel=0.015)
    assert found.holds
    rng = np.random.default_rng(2)
    ends = {}
    for ratio in (3.2, 4.0):
        loop = Hysteresis(ratio * 0.005, 0.005)
        flow = Flow(system, [loop, HALF])
        x = 10.0 ** rng.uniform(-1.0, 1.0, (8, 1)) * 0.02 * rng.uniform(-1.0, 1.0, (8, 6))
        memory = np.array([[loop.advance(0.0, one[1]), 0.0] for one in x])
        ends[ratio] = {STATES[one] for one in end_states(flow, x, memory).state}
    assert ends[4.0] == {"damped"}
    assert ends[3.2] - {"damped"}


def test_nothing_is_said_above_flutter_or_of_what_it_does_not_cover():
    assert not several_at(BOTH.at(1.01 * FLUTTER), [Hysteresis(1.0, 0.2), HALF]).holds
    assert not several_at(BOTH.at(0.99 * FLUTTER), [Hysteresis(1.0, 5.0), HALF]).holds
    assert not Several(needed=1.0).holds
