"""What something does to a session's row, and how far coefficients follow it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from calib.benchmarks.effects.drawn import DrawnWorld, draw_world
from calib.benchmarks.effects.filming import Filming, film_together
from calib.benchmarks.effects.rows import SessionRows
from calib.benchmarks.effects.suite import Recorded, SessionPlan
from diagnosis import discrepancy_for
from reality import Recording
from session import FISHSIM_MARKERS
from swimmer import load_robot

PLAN = SessionPlan("w00000001", 11, Recorded((0.6, 1.0), (0.8,), 4.0, None, False, False), "null")
DISCREPANCY = discrepancy_for(FISHSIM_MARKERS, load_robot())
FAR, NEAR = (2.0, 0.6, 1.5, 1.2, 0.7), (1.02, 1.0, 1.0, 1.0, 1.0)  # by which coefficients of the water are others


@lru_cache(maxsize=1)
def filmed() -> tuple[SessionRows, Mapping[str, Recording], Mapping[str, Recording]]:
    """The rows of a session, and what it would have looked like in other water, far and near."""
    ((drawn, base, *others),) = film_together([_filming()])
    return SessionRows.of(drawn, base, DISCREPANCY), others[0], others[1]


def _filming() -> Filming[tuple[DrawnWorld, Mapping[str, Recording], Mapping[str, Recording], Mapping[str, Recording]]]:
    drawn = yield from draw_world(PLAN)
    worlds = [
        replace(drawn.world, coefficients=tuple(np.multiply(drawn.world.coefficients, by)))
        for by in (np.ones(5), FAR, NEAR)
    ]
    recordings = yield [(world, each.trial) for world in worlds for each in drawn.trials]
    seen = iter(recordings)
    base, far, near = ({each.name: next(seen) for each in drawn.trials} for _ in worlds)
    return drawn, base, far, near


@pytest.mark.long
def test_other_water_is_followed_by_the_refitted_twin_however_far_it_has_to_go() -> None:
    """But for what the twin leaves of that water more or less than of this."""
    rows, far, _ = filmed()
    about_base, about_refitted = rows.changes(far)
    assert about_refitted.at[0] / rows.coefficients[0] == pytest.approx(FAR[0], rel=0.15)
    left = [change.space.length(change.row) for change in (about_base, about_refitted)]
    assert left[1] < 0.7 * left[0]
    assert np.array_equal(rows.change(far).row, about_base.row)


@pytest.mark.long
def test_what_coefficients_follow_in_a_short_step_is_looked_at_once() -> None:
    rows, _, near = filmed()
    (about_base,) = rows.changes(near)
    assert about_base.at == pytest.approx(rows.coefficients)
    assert about_base.space.length(about_base.row) < 1.0
