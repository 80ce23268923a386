"""How far somebody who knows the effect can shrink the gap of swims that nothing was fitted to."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from benchmarks.effects.drawn import DrawnWorld, draw_world
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.making import oracle_shrinkage
from benchmarks.effects.rows import SessionRows
from benchmarks.effects.suite import Recorded, SessionPlan
from benchmarks.reality import Recording
from benchmarks.reality.mechanisms import CATALOGUED
from diagnosis.discrepancy import discrepancy_for
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.robot import load_robot

PLAN = SessionPlan("w00000001", 11, Recorded((0.6, 1.0), (0.8,), 4.0, None, False, False), "single")
TRUE, OTHER = "bend_offset", "wave_drag"
Seen = dict[str, Recording]


def filming(name: str, strength: float) -> Filming[tuple[DrawnWorld, Seen, Seen]]:
    drawn = yield from draw_world(PLAN)
    mechanisms = CATALOGUED[name](np.random.default_rng(4))(strength)
    return drawn, (yield from drawn.recorded()), (yield from drawn.recorded(mechanisms))


@lru_cache
def seen(name: str, strength: float) -> tuple[SessionRows, SessionRows, Seen, Seen]:
    """Rows of fitted and held-out swims, and all swims without and with an effect of reality."""
    ((drawn, base, changed),) = film_together([filming(name, strength)])
    known = discrepancy_for(FISHSIM_MARKERS, load_robot())
    fitted = SessionRows.of(drawn, base, known)
    return fitted, SessionRows.of(drawn, base, known, "holdout", fitted.coefficients), base, changed


def shrunk(name: str, strength: float, by: str) -> float:
    fitted, held, _, changed = seen(name, strength)
    found = oracle_shrinkage([catalogue()[by]], fitted, held, changed)
    assert found is not None
    return found


@pytest.mark.long
def test_the_true_effect_shrinks_most_of_the_gap_and_another_next_to_nothing() -> None:
    assert 0.7 < shrunk(TRUE, 2.0, TRUE) < 1.0
    assert shrunk(TRUE, 2.0, OTHER) < 0.3
    fitted, held, base, _ = seen(TRUE, 2.0)
    assert oracle_shrinkage([catalogue()[TRUE]], fitted, held, base) is None


@pytest.mark.long
def test_what_shows_in_how_markers_slide_counts_as_a_diagnosis_counts_it() -> None:
    """A bent lens makes markers slide, which its form follows; of beats alone it would make the gap larger."""
    assert shrunk("lens_distortion", 1.0, "lens_distortion") > 0.5


@pytest.mark.long
def test_how_markers_are_glued_in_every_session_is_not_what_a_form_that_moves_markers_is_asked_for() -> None:
    """Less than they are off in the base state: what is fitted to both would be worse than nothing."""
    assert shrunk("marker_offset", 0.15, "marker_offset") > 0.6
