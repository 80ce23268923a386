"""How strong an effect is made; and how far its nearest rival is, held against one refitted with the simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from benchmarks.effects import severity
from benchmarks.effects.drawn import draw_world
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.rows import SessionRows, camera_of, closest_fit
from benchmarks.effects.severity import Strength, strength_for
from benchmarks.effects.suite import Recorded, SessionPlan
from benchmarks.reality import Recording
from benchmarks.reality.mechanisms import CATALOGUED
from diagnosis.discrepancy import discrepancy_for
from fitting.affected_trials import AffectedSession
from fitting.signatures import PRIOR_SD
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect
from swimcal.errors import SimulationDiverged
from swimcal.mjcf import COEFFICIENT_BOUNDS
from swimcal.robot import load_robot

PLAN = SessionPlan("w00000001", 11, Recorded((0.6, 1.0), (0.8,), 4.0, None, False, False), "single", ("scale_error",))
TRUE, ASKED = "scale_error", 10.0
STEP, ROUNDS = 1e-3, 6  # relative, of differences; of least squares


def filming() -> Filming[tuple[SessionRows, Strength, Mapping[str, Recording]]]:
    drawn = yield from draw_world(PLAN)
    rows = SessionRows.of(drawn, (yield from drawn.recorded()), discrepancy_for(FISHSIM_MARKERS, load_robot()))
    made = CATALOGUED[TRUE](np.random.default_rng(4))
    found = yield from strength_for(ASKED, made, TRUE, drawn, rows, rows.signatures(catalogue()))
    return rows, found, (yield from drawn.recorded(found.mechanisms, drawn.swims("fit")))


def in_truth(rows: SessionRows, recordings: Mapping[str, Recording], effects: Sequence[Effect]) -> float:
    """Distance of the nearest twin with effects, coefficients and values moved with the simulation, not linearly.

    A routine of its own, from the nearest that a straight line finds: SciPy's trust region, over shares of each range.
    """
    changes = rows.changes(recordings)
    number, reported = closest_fit(changes, rows.signatures({effect.name: effect for effect in effects}))
    others = rows._build_model(recordings)
    seen, turns = rows._subtract_base(others, with_course=False), rows._compute_turns(others)
    session = AffectedSession.of(effects, seen, camera_of(rows.drawn), rows.coefficients)
    parameters = [parameter for effect in session.effects for parameter in effect.parameters]
    plain_hz = session.hertz(np.zeros((1, len(parameters))))
    commanded = np.array([each.trial.frequency.hz - (each.trial.commanded_hz or np.nan) for each in seen.trials])

    def residuals(shares: np.ndarray) -> np.ndarray:
        point = low + (high - low) * shares
        at, values = point[None, :5], point[None, 5:]
        features = seen.measured - session.features(at, values)[0]
        row = turns @ np.concatenate([features, commanded - (session.hertz(values) - plain_hz)[0]])
        white = solve_triangular(rows.space.root, row, lower=True)
        return np.concatenate([white, (point[:5] - rows.coefficients) / PRIOR_SD])

    low = np.array([COEFFICIENT_BOUNDS[0]] * 5 + [parameter.low for parameter in parameters])
    high = np.array([COEFFICIENT_BOUNDS[1]] * 5 + [parameter.high for parameter in parameters])
    straight = rows.coefficients + changes[number].space.coefficients(reported.residual)
    start = np.clip((np.concatenate([straight, *reported.values]) - low) / (high - low), STEP, 1 - STEP)
    found = least_squares(residuals, start, bounds=(0, 1), diff_step=STEP, max_nfev=ROUNDS)
    return float(np.sqrt(2 * found.cost))


def searched(monkeypatch: pytest.MonkeyPatch, asked: float, distance: Callable[[float], float | None]) -> Strength:
    """What comes of asking where the nearest rival is at a distance that is known of each strength."""

    def tried(value: float, *_: object) -> Filming[Strength | None]:
        found = distance(value)
        return None if found is None else Strength(value, (), found, ())
        yield []

    monkeypatch.setattr(severity, "_try_strength", tried)
    (found,) = film_together([strength_for(asked, lambda _: (), None, None, None, ())])  # type: ignore[arg-type]
    return found


@pytest.mark.parametrize("asked", [1.0, 3.3, 10.0])
@pytest.mark.parametrize("strong", [0.05, 1.0, 4.0])
def test_it_is_as_far_as_asked(asked: float, strong: float, monkeypatch: pytest.MonkeyPatch) -> None:
    found = searched(monkeypatch, asked, lambda value: 8 * (value / strong) ** 0.8)
    assert found.detectability == pytest.approx(asked, rel=0.05)


@pytest.mark.parametrize("asked", [1.0, 2.0, 3.3])
def test_where_the_own_form_fails_when_it_is_strong_it_is_made_weaker(
    asked: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = searched(monkeypatch, asked, lambda value: 12 * value if value < 0.4 else 0.0)
    assert found.detectability == pytest.approx(asked, rel=0.1)


def test_what_a_rival_follows_is_as_strong_as_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    assert searched(monkeypatch, 10.0, lambda value: value / (1 + value)).value == 30.0


def test_what_is_never_nearer_in_its_own_form_is_as_weak_as_was_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    assert searched(monkeypatch, 5.0, lambda _: 0.0).value < 0.01


def test_what_cannot_be_simulated_is_made_weaker(monkeypatch: pytest.MonkeyPatch) -> None:
    found = searched(monkeypatch, 2.0, lambda value: 8 * value if value < 0.6 else None)
    assert found.detectability == pytest.approx(2.0, rel=0.05)
    with pytest.raises(SimulationDiverged, match="no strength could be simulated"):
        searched(monkeypatch, 2.0, lambda _: None)


@pytest.mark.long
def test_the_nearest_rival_is_as_far_when_it_is_refitted_with_the_simulation() -> None:
    ((rows, found, recordings),) = film_together([filming()])
    assert found.detectability == pytest.approx(ASKED, rel=0.05)
    nearest, distance = next(iter(found.rivals.items()))
    own, rival = (in_truth(rows, recordings, [catalogue()[name]]) for name in (TRUE, nearest))
    assert np.sqrt(rival**2 - own**2) == pytest.approx(distance, rel=0.08)
