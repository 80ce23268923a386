"""What something does to a session's row, and how far coefficients follow it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.effects import rows as rows_module
from benchmarks.effects.drawn import DrawnWorld, draw_world
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.rows import Change, SessionRows, closest_fit
from benchmarks.effects.suite import Recorded, SessionPlan
from benchmarks.reality import Recording
from diagnosis.discrepancy import discrepancy_for
from fitting.signatures import Signature, Whitened
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.effect import Parameter
from swimcal.robot import load_robot

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


class Toy:
    """A row of one coefficient, c, c squared and nothing, whose plain twin stands at 0; an effect adds (2, 1, 0.1)."""

    curved = 0.01

    def seen_from(self, place: float, of: np.ndarray) -> Change:
        step = np.array([place, 0.0, 0.0, 0.0, 0.0])
        slopes = np.column_stack([[1.0, 2 * self.curved * place, 0.0], np.zeros((3, 4))])
        space = Whitened.of(np.eye(3), slopes, np.full(5, 1e3))
        return Change(of - [place, self.curved * place**2, 0.0] + slopes @ step, space, step)

    @property
    def effect(self) -> Signature:
        does = np.array([2.0, 1.0, 0.1])
        parameter = Parameter("strength", "1", -50.0, 50.0, 1.0)
        tried = np.array([[-10.0], [10.0]])
        return Signature(SimpleNamespace(name="own", parameters=(parameter,)), tried, tried * does, np.zeros((2, 0)))  # type: ignore[arg-type]


def test_what_the_plain_twin_follows_is_told_from_where_its_coefficients_go() -> None:
    """In a straight line from the base state it would never get there: from there 16 squared over 100 are missing."""
    toy, row = Toy(), np.array([16.0, 2.56, 0.0])
    number, reported = closest_fit([toy.seen_from(place, row) for place in (0.0, 16.0)], [])
    assert number == 1
    assert reported.distance < 0.1
    assert closest_fit([toy.seen_from(0.0, row)], [])[1].distance > 2.0


def test_what_an_effect_does_is_told_from_where_coefficients_are_with_it() -> None:
    toy, row = Toy(), np.array([20.0, 10.0, 1.0])
    number, reported = closest_fit([toy.seen_from(place, row) for place in (0.0, 22.2)], [toy.effect])
    assert number == 0
    assert reported.distance < 0.1
    assert reported.values[0] == pytest.approx([10.0], rel=0.01)


@pytest.mark.long
def test_other_water_is_followed_by_the_refitted_twin_however_far_it_has_to_go() -> None:
    """But for what the twin leaves of that water more or less than of this."""
    rows, far, _ = filmed()
    from_base, refitted = rows.changes(far)
    assert refitted.strays(refitted.row) < 0.2 * from_base.strays(from_base.row)
    there = rows.coefficients + refitted.space.coefficients(refitted.row)
    assert there[0] / rows.coefficients[0] == pytest.approx(FAR[0], rel=0.15)
    left = [change.space.length(change.row) for change in (from_base, refitted)]
    assert left[1] < 0.7 * left[0]
    assert closest_fit([from_base, refitted], [])[0] == 1


@pytest.mark.long
def test_what_coefficients_follow_in_a_short_step_is_looked_at_once() -> None:
    rows, _, near = filmed()
    (from_base,) = rows.changes(near)
    assert not from_base.step.any()
    assert from_base.space.length(from_base.row) < 1.0


@pytest.mark.long
def test_where_the_refitted_twin_diverges_the_base_state_alone_is_seen_from(monkeypatch: pytest.MonkeyPatch) -> None:
    rows, far, _ = filmed()
    monkeypatch.setattr(rows_module, "nearest", lambda *_: np.full(5, np.nan))
    assert len(rows.changes(far)) == 1
