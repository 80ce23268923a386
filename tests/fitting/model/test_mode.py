"""The mode finds the truth of a drawn session, and its forecasts of a trial that was held out hold."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.posterior.truth import DrawnSession, draw_session
from benchmarks.reality.mechanisms.fluid import SurfaceMotion
from fitting.baselines import BASELINES
from fitting.covariance import COMPONENTS, MEDIANS, Covariance
from fitting.descent import Descent
from fitting.features import SPEED
from fitting.forecast import Windows, forecast_new, forecast_repeat, scatter_of, tracks_of
from fitting.mode import Mode, mode_at
from fitting.search import find_mode, pass_through
from fitting.session_model import SessionModel
from fitting.structure import assumed, perturbed_twins, uncertainties_of
from fitting.trial_model import START_PHASE_RAD, START_SD, TrialModel, sensitivities_together

HELD_OUT_HZ = 1.1
FAR_SD = 3.5
BISTABLE = (0.02, 2.56, 2.93, 1.32, 4.55)  # forward or backward, by the start
SESSIONS, HOLD = 20, 0.8  # a long test of intervals, nominally 0.9: five coefficients a session
HOLD_IN_ONE = 0.6  # nominally 0.9; seven sessions held 0.69 to 1.0, on average 0.92


def mode_of(drawn: DrawnSession, starts: int = 2) -> Mode:
    doubted = perturbed_twins(drawn.twin, uncertainties_of(assumed(drawn.twin.robot).sources))
    windows = (TrialModel(drawn.twin, each, START_PHASE_RAD, doubted, with_course=True) for each in drawn.trials)
    return find_mode(SessionModel(tuple(windows)), starts)


def rolling(drawn: DrawnSession, per_sway: float, natural_hz: float) -> DrawnSession:
    """The same swims of a hull that rolls, integrated in time by the second simulator's oscillator."""
    robot, float_ = drawn.twin.robot, SurfaceMotion(per_sway, 0.0, natural_hz, 1.0, 0.2, 0.0)
    mass_kg = sum(part.mass_kg for part in robot.head.part)
    centre_m = sum(part.mass_kg * part.centre_m[0] for part in robot.head.part) / mass_kg
    swims = []
    for trial in drawn.trials:
        told = drawn.twin.simulate(TrialModel(drawn.twin, trial, 1.0).runs(np.array([drawn.truth])), trial.time_s)
        x, y, yaw = told.head[0].T
        centre = x + 1j * y + centre_m * np.exp(1j * yaw)
        pushed = (np.gradient(np.gradient(centre, trial.time_s), trial.time_s) * np.exp(-1j * yaw)).imag
        roll = float_._swing(trial.time_s, per_sway * pushed, natural_hz)
        swung = 1j * np.exp(1j * yaw)[:, None] * roll[:, None] * robot.marker_positions_m(trial.markers)[:, 2]
        place = told.marker_m[0] + np.stack([swung.real, swung.imag], axis=-1)
        noise = np.random.default_rng(len(swims)).normal(0.0, 3e-4, place.shape)
        swims.append(trial.seen_as(position_m=place + noise))
    return replace(drawn, trials=tuple(swims))


@pytest.fixture(scope="module")
def drawn() -> DrawnSession:
    return draw_session(2, held_out_hz=(HELD_OUT_HZ,), step=1 / 4)


@pytest.fixture(scope="module")
def mode(drawn: DrawnSession) -> Mode:
    return mode_of(drawn, starts=1)


def test_steps_from_points_about_the_mode_lead_apart_by_less_than_its_error(mode: Mode) -> None:
    assert (mode.spread > 0).all()
    assert (mode.spread < np.sqrt(np.diag(mode.coefficient_covariance))).all()


def test_next_to_a_second_steady_state_the_start_does_not_explain_any_speed(mode: Mode) -> None:
    """Of this water the slope at 0.8 Hz is 0.3 m/s for a standard deviation of the start, a centimetre a second."""
    slow = mode.model.trials[1]
    both = (sensitivities_together([slow], np.array(at))[0] for at in (BISTABLE, mode.coefficients))
    of_start, plain = (each.own[SPEED, :3] for each in both)
    assert np.linalg.norm(of_start) == pytest.approx(START_SD[0])
    assert np.linalg.norm(plain) < 0.1 * START_SD[0]


def test_the_density_of_a_descent_is_that_where_it_stands(mode: Mode) -> None:
    """Where it is stopped far from the mode, as by twins that swim backward, variance components alone do not say."""
    aside = 4 * np.sqrt(np.diag(mode.coefficient_covariance)) * np.array([0, 1, 0, 0, 0])
    places = mode.coefficients, mode.coefficients + aside
    at_mode, off = (Descent(mode.model, at, mode.blocks) for at in places)
    for descent in (at_mode, off):
        descent.run(0)
    assert at_mode.promise - at_mode.log_density < 0.2
    assert off.promise - off.log_density > 4.0
    assert off.log_density < at_mode.log_density - 4.0
    free = copy(off)
    free.forward, free.blocked = True, True
    assert pass_through(free, 0).log_density > off.log_density + 4.0


def test_the_truth_is_found_from_starts_all_over_the_box(drawn: DrawnSession, mode: Mode) -> None:
    sd = np.sqrt(np.diag(mode.coefficient_covariance))
    assert np.abs((mode.coefficients - np.array(drawn.truth)) / sd).max() < FAR_SD
    assert mode.ends[0].converged
    start = mode.ends[0].start
    assert np.abs(start - mode.coefficients).max() > 10 * np.median(sd)


@pytest.mark.long
def test_a_roll_of_the_hull_is_found_with_the_coefficients(drawn: DrawnSession, mode: Mode) -> None:
    assert abs(mode.roll.per_sway) < 5  # there is none
    found = mode_of(rolling(drawn, 25.0, 0.75))
    assert found.roll.per_sway == pytest.approx(25.0, rel=0.15)
    assert found.roll.natural_hz == pytest.approx(0.75, rel=0.1)
    sd = np.sqrt(np.diag(found.coefficient_covariance))
    assert np.abs((found.coefficients - np.array(drawn.truth)) / sd).max() < FAR_SD


def test_a_held_out_trial_is_forecast_and_its_first_beats_tell_more(drawn: DrawnSession, mode: Mode) -> None:
    trial = drawn.held_out[0]
    windows = Windows.of(mode, trial)
    before, after = forecast_new(mode, windows, scatter_of(mode))
    assert after is not None
    measured = windows.late.measured[SPEED]
    for told in (before, after):
        assert abs(told.speed - measured) < FAR_SD * told.speed_sd
    assert after.speed_sd < before.speed_sd
    assert before.inside(trial.scored) > HOLD


@pytest.mark.long
def test_a_marker_that_is_never_seen_leaves_the_scatter_within_trials_finite(mode: Mode) -> None:
    def blind(model: TrialModel) -> TrialModel:
        weight = model.trial.tracks.weight.copy()
        weight[:, -1] = 0.0
        return replace(model, trial=replace(model.trial, tracks=model.trial.tracks.assign(weight=weight)))

    trials = tuple(map(blind, mode.model.trials))
    one_less = mode_at(replace(mode.model, trials=trials), mode.coefficients, mode.sizes, mode.roll, mode.ends)

    assert not one_less.blocks[0].model.reader.observed.all()
    assert scatter_of(one_less).noise == pytest.approx(scatter_of(mode).noise, rel=0.3)


def test_a_fitted_trial_lies_within_the_bands_of_its_repeat(mode: Mode) -> None:
    inside = []
    for number, block in enumerate(mode.blocks):
        again = forecast_repeat(mode, number)
        assert abs(again.speed - block.model.measured[SPEED]) < FAR_SD * again.speed_sd
        inside.append(again.inside(block.model.trial.scored))
    assert np.mean(inside) > HOLD_IN_ONE


def test_tracks_made_of_features_have_these_features(mode: Mode) -> None:
    window = mode.blocks[0].model
    tracks = tracks_of(window.measured[None], window)[0]
    found = window.in_step(window.reader(tracks[window.trial.kept]))
    assert found == pytest.approx(window.measured, abs=2e-3)


def test_a_component_is_found_where_trials_tell_it_and_keeps_its_prior_where_they_do_not() -> None:
    random = np.random.default_rng(4)
    count = 400
    units = {component.name: np.zeros((count, count)) for component in COMPONENTS}
    units["turning"] = np.diag((np.arange(count) < count // 2).astype(float))
    covariance = Covariance(1e-4 * np.eye(count), np.zeros((count, 2)), units)
    residual = np.sqrt(np.diag(covariance.at(MEDIANS | {"turning": 0.2}))) * random.standard_normal(count)
    found, _ = covariance.restricted(residual, np.zeros((count, 5)), MEDIANS)
    assert found["turning"] == pytest.approx(0.2, rel=0.2)
    for name, median in MEDIANS.items():
        if name != "turning":
            assert found[name] == pytest.approx(median)


@pytest.mark.long
def test_windows_of_one_trial_share_its_own_draws_and_no_others(mode: Mode) -> None:
    block = mode.blocks[0]
    same, other = (Covariance.of([block, block._replace(trial=whose)]) for whose in (block.trial, block.trial + 1))
    length = len(block.model.measured)
    for component in COMPONENTS:
        within = other.units[component.name][:length, :length]
        between = other.units[component.name][:length, length:]
        assert between == pytest.approx(np.zeros_like(within) if component.level == "trial" else within)
        assert same.units[component.name][:length, length:] == pytest.approx(within)


def test_baselines_go_through_what_they_are_fitted_to() -> None:
    hz, speed = [0.75, 1.3], [0.08, 0.16]
    assert BASELINES["line"].rule(hz, speed, hz) == pytest.approx(speed)
    assert BASELINES["power_law"].rule(hz, speed, hz) == pytest.approx(speed)
    assert BASELINES["power_law"].rule([1.0], [0.1], [2.0]) == pytest.approx([0.2])
    assert BASELINES["constant_stride"].rule(hz, [0.075, 0.13], [1.0]) == pytest.approx([0.1])
    assert np.isnan(BASELINES["power_law"].rule(hz, [0.1, -0.1], [1.0])).all()


def test_a_block_of_another_speed_has_a_discrepancy_in_proportion(mode: Mode) -> None:
    block = mode.blocks[0]
    faster = np.array(block.features)
    faster[SPEED] *= 2
    slow, fast = (Covariance.of([block._replace(features=features)]) for features in (block.features, faster))
    for name in ("speed_common", "speed_own"):
        assert fast.units[name] == pytest.approx(4 * slow.units[name])


@pytest.mark.long
def test_nothing_of_what_is_scored_enters_a_forecast(drawn: DrawnSession, mode: Mode) -> None:
    """But its phase, in which features are compared."""
    late = Windows.of(mode, drawn.held_out[0]).late
    place = np.array(late.trial.position_m)
    place[late.trial.kept] *= 1.1
    other = replace(late, trial=late.trial.seen_as(position_m=place))
    one, same = (forecast_new(mode, Windows(None, window))[0] for window in (late, other))
    assert same.mean == pytest.approx(one.mean, abs=1e-5)
    assert same.covariance == pytest.approx(one.covariance, abs=1e-6)


@pytest.mark.long
def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    inside: list[np.ndarray] = []
    for seed in range(500, 500 + SESSIONS):
        drawn = draw_session(seed)
        mode = mode_of(drawn)
        off = mode.coefficients - np.array(drawn.truth)
        inside.append(np.abs(off) < 1.645 * np.sqrt(np.diag(mode.coefficient_covariance)))
    assert np.mean(inside) >= HOLD


@pytest.mark.long
def test_a_mode_that_is_known_is_made_again_without_a_search(mode: Mode) -> None:
    again = mode_at(mode.model, mode.coefficients, mode.sizes)
    sd = np.sqrt(np.diag(mode.coefficient_covariance))
    assert np.sqrt(np.diag(again.coefficient_covariance)) == pytest.approx(sd, rel=0.1)
    assert np.abs(again.residual - mode.residual).max() < 1e-3


def test_two_beats_tell_a_speed_that_the_fitted_trials_do_not(drawn: DrawnSession, mode: Mode) -> None:
    trial = drawn.held_out[0]
    along = trial.position_m[-1, 0] - trial.position_m[0, 0]
    more = 0.2 * (trial.time_s / trial.time_s[-1])[:, None] * along
    other = trial.seen_as(position_m=trial.position_m + more[:, None])
    windows = Windows.of(mode, other)
    measured = windows.late.measured[SPEED]
    before, after = forecast_new(mode, windows)
    assert after is not None
    assert abs(after.speed - measured) < 0.75 * abs(before.speed - measured)
    assert abs(after.speed - measured) < FAR_SD * after.speed_sd
