"""A reference session foretells what a changed one would show without change, whatever both have in common."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.constants import ONE_CHANGE, TILT_PER_M
from diagnosis.diagnose import Diagnosis, Settings, _name_change, _share_left, diagnose
from diagnosis.diagnosis_file import diagnosis_result
from diagnosis.discrepancy import discrepancy_for, generic_covariance
from diagnosis.evidence import Hypotheses, Priors
from diagnosis.hypotheses import average_hypotheses
from diagnosis.linear_model import SessionData, slides_of_tilt
from diagnosis.reference import Comparison, Sizes
from diagnosis.refit import Refit
from diagnosis.sentences import where, which
from diagnosis.verdict import verdict_of
from fitting.dry_run import with_arm
from fitting.features import advance_phase, marker_part, places_of_slides
from fitting.signatures import little, signature_of
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Observation, Parameter
from swimcal.effects.measurement import LensDistortion
from swimcal.errors import NotEnoughData
from swimcal.twin import Twin
from tests.cases import later
from tests.diagnosis.linear_models import AT, CAMERA, ROBOT, shorter
from tests.fitting.exact_swims import exact_swims, exact_twin

EFFECTS = {name: catalogue()[name] for name in ("crank_arm_error", "bend_offset", "scale_error", "joint_damping")}
LONGER = 0.03  # by which the arm of the changed robot is longer


@cache
def swims(longer: float, seed: int) -> tuple[MeasuredTrial, ...]:
    robot = with_arm(ROBOT, ROBOT.crank.arm_m * (1 + longer))
    return exact_swims(hz=(0.7, 1.1), seconds=4.0, noise_m=3e-4, seed=seed, robot=robot)


def data(longer: float, seed: int, twin: Twin) -> SessionData:
    return SessionData(swims(longer, seed), twin, CAMERA, discrepancy_for(FISHSIM_MARKERS, ROBOT), AT)


def compared(longer: float, twin: Twin) -> Diagnosis:
    return diagnose(replace(data(longer, 5, twin), reference=data(0.0, 1, twin)), EFFECTS, Settings("quick"))


@cache
def wrong_twin() -> Twin:
    """Of a robot that is described wrongly in both sessions."""
    return Twin(shorter(0.02), FISHSIM_MARKERS, workers=1)


@cache
def joint() -> Comparison:
    found = Comparison.of(replace(data(0.0, 5, wrong_twin()), reference=data(0.0, 1, wrong_twin())))
    at = found.joint
    return found.with_signatures([signature_of(each, at.model, CAMERA, at.at) for each in EFFECTS.values()])


@pytest.mark.long
def test_what_both_sessions_share_is_no_change() -> None:
    found = compared(0.0, wrong_twin())
    assert found.said.verdict.name == "no_gap"
    told = diagnosis_result(found)
    assert told.reference is not None
    assert told.reference.swims == ("f0.70", "f1.10")
    assert "nothing changed" in which(told)
    assert "launches" in where(told)
    least = told.reference.visible["crank_arm_error"]
    assert least.unit == "1"
    assert 0 < least.value < LONGER


def test_a_change_is_named_with_its_size_not_with_the_error_of_both() -> None:
    found = compared(LONGER, wrong_twin())
    assert found.said.verdict.groups == (("crank_arm_error",),)
    best = found.said.best
    assert best is not None
    sd = float(np.sqrt(best.covariance[5, 5]))
    assert best.values[0] == pytest.approx(LONGER, abs=max(3 * sd, 0.01))


def test_a_drift_is_told_from_a_marker_off_its_place_and_what_is_near_a_threshold_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A marker slides aside of its neighbours, which one off its place does not, however far it is off in the mean."""
    pace, twin, drifting = 0.003, exact_twin(workers=1), []
    for swim in swims(0.0, 5)[1:]:
        before, own, behind = (swim.markers.index(name) for name in ("tail_3", "tail_4", "tail_5"))
        position_m = swim.position_m.copy()
        along = position_m[:, behind] - position_m[:, before]
        across = along[:, ::-1] * [-1.0, 1.0] / np.linalg.norm(along, axis=1, keepdims=True)
        position_m[:, own] += pace * (swim.time_s - swim.time_s[0])[:, None] * across
        drifting.append(swim.seen_as(position_m=position_m))
    changed = replace(
        data(0.0, 5, twin), trials=tuple(drifting), reference=replace(data(0.0, 1, twin), trials=swims(0.0, 1)[1:])
    )
    effects = {name: catalogue()[name] for name in ("marker_offset", "tracker_drift")}
    found = diagnose(changed, effects, Settings("quick"))
    assert found.said.verdict.groups == (("tracker_drift",),)
    best = found.said.best
    assert best is not None
    number = [each.name for each in best.effects[0].parameters].index("tail_4_across")
    assert abs(best.values[number]) == pytest.approx(pace, rel=0.3)

    linear = found.weighed.linear
    monkeypatch.setattr(Hypotheses, "shows_in_creeps", lambda *_: False)  # so that what stays decides
    refits = {"tracker_drift": best, "marker_offset": Refit.plain(linear)}
    left = _share_left(linear, best)
    for most, told in (
        (left - 0.1, ("unexplained", None)),
        (left - 0.001, ("unexplained", "named")),
        (left + 0.001, ("named", "unexplained")),
        (left + 0.1, ("named", None)),
    ):
        monkeypatch.setattr("diagnosis.diagnose.MOST_LEFT_OF_CHANGE", most)
        said = _name_change(found.weighed, lambda names: refits[names[0]], Settings("quick"), len(effects))
        assert (said.verdict.name, said.near and said.near.name) == told


@pytest.mark.parametrize("unseen", ["changed", *later("changed and reference")])
def test_a_marker_that_is_not_seen_is_not_measured_as_what_the_reference_foretells(unseen: str) -> None:
    sessions = {"changed": data(0.0, 5, exact_twin(workers=1)), "reference": data(0.0, 1, exact_twin(workers=1))}
    for name in unseen.split(" and "):
        seen, hidden = sessions[name].trials
        weight = hidden.own_weight * (np.arange(len(hidden.markers)) != hidden.markers.index("tail_4"))
        sessions[name] = replace(sessions[name], trials=(seen, hidden.seen_as(weight=weight)))
    found = Comparison.of(replace(sessions["changed"], reference=sessions["reference"]))
    linear = found.model_of("changed", Sizes(1.0, 0.003, 1.0))
    observed = linear.observed

    assert not observed.all()
    assert not linear.residual[~observed].any()
    assert not linear.covariance[np.ix_(~observed, observed)].any()


@pytest.mark.long
def test_given_a_reference_a_row_is_known_better_and_expected_elsewhere() -> None:
    both, sizes = joint(), Sizes(1.0, 0.003, 1.0)
    given = both.model_of("changed", sizes)
    alone = both._covariance(sizes, both._places(both._numbers("changed"), "changed"))
    before, after = (np.sqrt(np.diag(each)) for each in (alone, given.covariance))
    assert (after <= before + 1e-12).all()
    assert after[0] < 0.5 * before[0]  # the speed, which the reference tells best
    assert np.linalg.norm(given.foretold) > 0
    assert np.linalg.eigvalsh(given.covariance).min() > 0
    rows = both.of_changed[0]
    assert rows.rows.shape[1] == len(given.residual)


def test_what_the_twin_misses_at_a_command_is_expected_again_there_whatever_its_form() -> None:
    both, sizes = joint(), Sizes(1.0, 0.0, 0.25)
    model, random = both.joint.model, np.random.default_rng(2)
    own = len(model.measured) // len(model.trials)
    form = np.linalg.cholesky(generic_covariance(model.trials[0].along_m, 1, 0)) @ random.standard_normal((own, 2))
    missed = advance_phase(2e-3 * np.tile(form.T, (2, 1)), model.phase_rad)  # one form at each of two commands
    off = np.concatenate([missed.ravel(), np.zeros(len(both.joint.residual) - missed.size)])

    def left(groups: tuple[str, ...]) -> float:
        shifted = replace(both, joint=replace(both.joint))
        whose = np.repeat([group in groups for group in both.groups], own)
        shifted.joint.__dict__["residual"] = np.where(np.append(whose, np.zeros(len(off) - len(whose), bool)), off, 0.0)
        rows = shifted.model_of("changed", sizes).residual[: 2 * own].reshape(2, own)
        return float(np.linalg.norm(marker_part(rows)) / np.linalg.norm(marker_part(missed[2:])))

    assert left(("reference", "changed")) < 0.65  # 0.995 where only what is alike over frequency comes again
    assert left(("changed",)) == pytest.approx(1.0)


def test_both_sessions_may_lie_in_still_water() -> None:
    found = Comparison.of(replace(data(0.0, 5, wrong_twin()), reference=data(0.0, 1, wrong_twin())))
    at, effects = found.joint, (*EFFECTS.values(), catalogue()["background_current"])
    both = found.with_signatures([signature_of(each, at.model, CAMERA, at.at) for each in effects])
    still, moving = (both._shared(moving=moving) for moving in (False, True))

    assert moving.shape[1] - still.shape[1] == len(catalogue()["background_current"].parameters)
    assert len(both.assumptions()) == 2 * len(joint().assumptions())


@pytest.mark.long
def test_the_order_of_the_trials_changes_nothing() -> None:
    twin, distances = wrong_twin(), []
    for order in ((0, 1), (1, 0)):
        turned = [swims(0.0, 5)[i] for i in order]
        changed = replace(data(0.0, 5, twin), trials=turned, reference=data(0.0, 1, twin))
        both = Comparison.of(changed)
        both = both.with_signatures([signature_of(EFFECTS["bend_offset"], both.joint.model, CAMERA, both.joint.at)])
        found = both.model_of("changed", Sizes(1.0, 0.003, 1.0))
        distances.append(float(found.space.length(found.residual)))
    assert distances[1] == pytest.approx(distances[0], rel=1e-6)


def test_what_swims_of_a_reference_miss_of_each_other_widens_what_it_foretells() -> None:
    both = joint()
    sd, random = np.sqrt(np.diag(both.joint.covariance)), np.random.default_rng(3)
    rough = replace(both, joint=replace(both.joint))
    rough.joint.__dict__["residual"] = both.joint.residual + 3 * sd * random.standard_normal(len(sd))
    sizes = both.sizes

    assert both.leave_one_out_error(sizes) < 1.2
    assert rough.leave_one_out_error(sizes) > 2
    assert rough.sizes.wider > 1.2
    plain, wide = (np.sqrt(np.diag(both.model_of("changed", sizes._replace(wider=w)).covariance)) for w in (1.0, 1.5))
    np.testing.assert_allclose(wide, 1.5 * plain)


@pytest.mark.parametrize("seed", [2, *later(0, 1, 3, 4, 5)])
def test_launches_that_scatter_more_than_the_reference_tells_have_no_name(seed: int) -> None:
    """All that is not foretold is 1.6 times as large as three swims of a reference let expect."""
    both = joint()
    space = both.model_of("changed", both.sizes).given
    assert space is not None
    found = []
    drawn = 1.6 * np.random.default_rng(seed).multivariate_normal(np.zeros(len(space.foretold)), space.covariance)
    for each in both.assumptions():
        each.linear.__dict__["residual"] = drawn
        found.append(each)
    told = average_hypotheses(found, both.of_changed, replace(Priors(), number=ONE_CHANGE, by_part=True))
    assert verdict_of(told.probabilities).name == "no_gap"


def test_how_well_the_motor_keeps_time_is_not_told_by_how_launches_differ() -> None:
    both = joint()
    rough, even = (both.model_of("changed", Sizes(1.0, 0.003, launch)).covariance for launch in (4.0, 1.0))
    features = len(both.joint.model.measured) // 2
    frequencies = slice(features, features + 2)
    assert (np.diag(rough) > 2 * np.diag(even))[:features].mean() > 0.3
    np.testing.assert_allclose(np.diag(rough)[frequencies], np.diag(even)[frequencies], rtol=1e-6)


def test_a_reference_without_a_fitted_swim_is_refused() -> None:
    twin = wrong_twin()
    held = [each.with_role("holdout") for each in swims(0.0, 1)]
    changed = replace(data(0.0, 5, twin), reference=replace(data(0.0, 1, twin), trials=held))
    with pytest.raises(NotEnoughData, match="reference session"):
        Comparison.of(changed)


class Tilted(LensDistortion):
    """What a tilted camera shows: a scale that grows across the picture."""

    name = "tilted"
    parameters = (Parameter("across", "1/m", -0.1, 0.1, 0.01), Parameter("along", "1/m", -0.1, 0.1, 0.01))

    def observe(self, seen: Observation, values: np.ndarray) -> np.ndarray:
        off = seen.marker_m - seen.view.axis_m
        return np.asarray(seen.marker_m + (off @ values)[..., None] * off)


def test_markers_slide_under_a_tilted_camera_as_it_is_expected_of_both_sessions() -> None:
    model = joint().joint.model
    signature = signature_of(Tilted(), model, CAMERA, AT)
    own = len(model.measured) // len(model.trials)
    expected = slides_of_tilt(model) / TILT_PER_M
    for number in range(len(model.trials)):
        slides = np.arange(own * number, own * (number + 1))[places_of_slides(own)]
        for parameter in range(2):
            slope = little(signature, parameter)
            assert slope is not None
            apart = slope[slides] - expected[slides, parameter]
            assert np.linalg.norm(apart) < 0.25 * np.linalg.norm(expected[slides])
