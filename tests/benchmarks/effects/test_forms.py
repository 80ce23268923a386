"""Reality's form of every effect is not the twin's: what the twin's own form leaves of what it does to a session.

That alone says little, for the simulators differ too: of reality with the very formula of the twin in it the twin
leaves up to a third. So the twin's formulas are put into reality as well (`twins_forms`), and what they leave
of reality's forms there, refitted, is of the forms alone. For camera and tracker, which need no simulator, see
`tests/benchmarks/reality/mechanisms/test_forms_of_measurement.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
import pytest

from benchmarks.effects.drawn import DrawnWorld, draw_world
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.rows import Change, SessionRows, closest_fit
from benchmarks.effects.suite import Recorded, SessionPlan
from benchmarks.reality import Mechanism, Recording
from benchmarks.reality.mechanisms import CATALOGUED, FAMILIES
from diagnosis.discrepancy import discrepancy_for
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.robot import load_robot
from tests.benchmarks.effects.twins_forms import TWINS_FORMS

PLAN = SessionPlan("w00000001", 11, Recorded((0.6, 1.0), (0.8,), 4.0, None, False, False), "null")
DRAW = 4
STRENGTHS = {"wall_proximity": 4.0, "mass_distribution": 4.0, "wave_drag": 30.0}
"""1 for all others: these would hardly be seen (waves are not at any strength, this fish is too slow for them)."""
LEFT = 0.01
"""Share that a form of its own leaves at least."""
Seen = tuple[Change, ...]
"""What a session's row is changed by."""


def session() -> Filming[tuple[DrawnWorld, Mapping[str, Recording]]]:
    drawn = yield from draw_world(PLAN)
    return drawn, (yield from drawn.recorded((), drawn.swims("fit")))


def seen(mechanisms: Sequence[tuple[Mechanism, ...]]) -> list[Seen]:
    """What each of these changes of the fitted swims, all filmed in one batch."""
    drawn = rows().drawn
    films = film_together(drawn.recorded(each, drawn.swims("fit")) for each in mechanisms)
    return [rows().changes(recordings) for recordings in films]


@lru_cache(maxsize=1)
def rows() -> SessionRows:
    ((drawn, base),) = film_together([session()])
    return SessionRows.of(drawn, base, discrepancy_for(FISHSIM_MARKERS, load_robot()))


@lru_cache(maxsize=1)
def in_its_own_form() -> Mapping[str, Seen]:
    """Every effect of the catalogue as reality has it."""
    made = {name: drawn(np.random.default_rng(DRAW))(STRENGTHS.get(name, 1.0)) for name, drawn in CATALOGUED.items()}
    return dict(zip(made, seen(list(made.values())), strict=True))


def changed(by: Seen) -> np.ndarray:
    """The same, whitened and with coefficients refitted, as seen from those of the base state."""
    return by[0].space.projected(by[0].row)


def left_by_the_twin(name: str) -> float:
    """Share that the twin, with its own form of the effect refitted, leaves of what reality's does to a session."""
    changes = in_its_own_form()[name]
    (itself,) = rows().signatures({name: catalogue()[name]})
    return closest_fit(changes, [itself])[1].distance / closest_fit(changes, [])[1].distance


def left_in_reality(name: str) -> float:
    """Share that the twin's formula, in reality itself and refitted, leaves of what reality's form does."""
    target = changed(in_its_own_form()[name])
    columns = np.column_stack([changed(each) for each in (*at_typical()[name], at_best()[name])])
    return float(np.linalg.norm(target - followed(columns, target)) / np.linalg.norm(target))


@lru_cache(maxsize=1)
def at_typical() -> Mapping[str, Sequence[Seen]]:
    """The twin's formula in reality, with each of its parameters by itself at its typical value."""
    wanted = [(name, form.of(*only)) for name, form in TWINS_FORMS.items() for only in np.diag(form.typical)]
    found: dict[str, list[Seen]] = {name: [] for name in TWINS_FORMS}
    for (name, _), changes in zip(wanted, seen([(copy,) for _, copy in wanted]), strict=True):
        found[name].append(changes)
    return found


@lru_cache(maxsize=1)
def at_best() -> Mapping[str, Seen]:
    """The same at the values that come nearest to reality's form, by a step of Newton's."""
    best = {}
    for name, form in TWINS_FORMS.items():
        columns = np.column_stack([changed(each) for each in at_typical()[name]])
        shares = np.linalg.lstsq(columns, changed(in_its_own_form()[name]), rcond=None)[0]
        best[name] = (form.of(*(shares * form.typical)),)
    return dict(zip(best, seen(list(best.values())), strict=True))


def followed(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    """What columns (k, q) make of a target (k,), by least squares."""
    return np.asarray(columns @ np.linalg.lstsq(columns, target, rcond=None)[0])


def test_the_twin_s_formula_is_known_of_every_effect() -> None:
    elsewhere = FAMILIES["measurement"]
    assert set(TWINS_FORMS) == set(CATALOGUED) - set(elsewhere)
    assert set(CATALOGUED) == set(catalogue())


@pytest.mark.long
@pytest.mark.parametrize("name", CATALOGUED)
def test_the_refitted_twin_leaves_something_of_a_session(name: str) -> None:
    assert left_by_the_twin(name) > LEFT


@pytest.mark.long
@pytest.mark.parametrize("name", TWINS_FORMS)
def test_reality_acts_in_a_form_of_its_own(name: str) -> None:
    assert left_in_reality(name) > LEFT
