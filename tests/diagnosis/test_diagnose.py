"""A whole diagnosis of swims of a robot whose crank arm is longer than described."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from diagnosis.diagnose import Diagnosis, Settings, WeighedEffects, _not_followed, diagnose, weigh_effects
from diagnosis.diagnosis_file import _parameters, diagnosis_result
from diagnosis.discrepancy import discrepancy_for
from diagnosis.held_out import HeldOut
from diagnosis.linear_model import SessionData
from diagnosis.refit import Refit, refit_from
from diagnosis.result import DIAGNOSIS, parameters_of
from diagnosis.sentences import which
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.results import Provenance
from swimcal.runs import CrankTurn
from swimcal.twin import Twin
from tests.cases import later
from tests.diagnosis.linear_models import ARM, AT, CAMERA, ROBOT, linear, shorter, trials

EFFECTS = {name: catalogue()[name] for name in ("crank_arm_error", "bend_offset", "scale_error")}
SCHEMA = Path(__file__).resolve().parents[3] / "shared" / "design" / "schema" / "diagnosis.schema.json"


def swims() -> list[MeasuredTrial]:
    """Two that are fitted and one that is held out."""
    return [*trials(), replace(trials()[0], name="held").with_role("holdout")]


def twin(by: float = ARM) -> Twin:
    """Of a robot whose arm is described too short."""
    return Twin(shorter(by), FISHSIM_MARKERS, workers=1)


def data() -> SessionData:
    """They beside that twin."""
    return SessionData(swims(), twin(), CAMERA, discrepancy_for(FISHSIM_MARKERS, ROBOT), AT)


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose(data(), EFFECTS, Settings("quick"))


@pytest.mark.long
def test_it_names_the_arm_and_the_gap_shrinks(found: Diagnosis) -> None:
    assert found.said.verdict.groups == (("crank_arm_error",),)
    assert found.said.best is not None
    assert found.said.best.values[0] == pytest.approx(ARM, abs=0.005)
    assert found.gap.squares_after < found.gap.squares_before
    assert found.gap.trials is not None
    for swim in found.gap.trials.values():
        forecasts = [swim.frequency_before_hz, swim.frequency_after_hz]
        np.testing.assert_allclose(forecasts, swim.frequency_measured_hz, rtol=0.01)
    assert found.said.skill is None  # none of two trials can be left out
    assert found.gap.with_effects_mm < found.gap.baseline_mm


def test_cranks_turn_as_logged_and_threads_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    class Looked(Exception):
        pass

    def fitted(swims: list[MeasuredTrial], *_: object, **__: object) -> None:
        threads = {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}
        raise Looked([trial.turn for trial in swims], threads)

    monkeypatch.setattr("diagnosis.linear_model.LinearModel.of", fitted)
    even = CrankTurn.measured(np.linspace(0.0, 9.0, 99), np.linspace(0.0, 60.0, 99))
    logged = [replace(trial, turn=even, beat=trial.frequency) for trial in trials()]
    with threadpool_limits(2), pytest.raises(Looked) as looked:
        diagnose(replace(data(), trials=logged), EFFECTS)
    assert looked.value.args == ([even] * len(logged), {1})


@pytest.mark.parametrize("logged", [False, True])
def test_what_only_a_motor_log_shows_is_not_looked_for_without_one(
    logged: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Looked(Exception):
        pass

    def look(_linear: object, effects: Mapping[str, Effect], _tell: object) -> None:
        raise Looked(set(effects))

    monkeypatch.setattr("diagnosis.diagnose._signatures", look)
    swims = [replace(trial, logged_hz=trial.frequency.hz if logged else None) for trial in trials()]
    with pytest.raises(Looked) as looked:
        diagnose(replace(data(), trials=swims), catalogue())
    assert ("motor_start_delay" in looked.value.args[0]) == logged
    assert "drive_ratio_error" in looked.value.args[0]


@pytest.mark.long
def test_a_known_strength_is_recovered_from_a_wrong_start() -> None:
    arm = refit_from(linear("shorter"), [catalogue()["crank_arm_error"]], np.array([-0.02]), rounds=6)
    sd = np.sqrt(arm.covariance[5, 5])
    assert abs(arm.values[0] - ARM) < 4 * sd
    assert sd < ARM / 4


@pytest.mark.long
def test_what_is_written_follows_the_contract(found: Diagnosis, tmp_path: Path) -> None:
    (path,) = DIAGNOSIS.write(tmp_path, Provenance("", "", {}, 0, "full"), diagnosis_result(found))
    if SCHEMA.exists():
        jsonschema.validate(json.loads(path.read_text()), json.loads(SCHEMA.read_text()))
    read = DIAGNOSIS.read(tmp_path)
    assert read.effects == ("crank_arm_error",)
    assert "crank arm error" in which(read)
    np.testing.assert_array_equal(read.missing_forces.mean, found.where.forces.mean)


@pytest.mark.long
def test_without_the_effect_in_the_catalogue_it_is_not_named() -> None:
    others = {name: effect for name, effect in EFFECTS.items() if name != "crank_arm_error"}
    told = diagnose(replace(data(), trials=trials()), others, Settings("quick"))
    assert "crank_arm_error" not in told.said.probabilities.names
    assert told.said.verdict.name != "named"
    assert not told.gap.evaluated_on


@pytest.mark.parametrize(
    ("name", "value", "at_bound"),
    [
        ("joint_damping", -0.499, True),  # -0.5 to 5
        ("joint_damping", -0.3, False),
        ("joint_damping", 4.99, True),
        ("skin_friction", 0.0, False),  # it has one sign: from 0 on; the plain twin is no bound
    ],
)
def test_a_parameter_is_at_its_bound_where_its_value_is(name: str, value: float, at_bound: bool) -> None:
    effect = catalogue()[name]
    found = Refit((effect,), np.ones(5), np.array([value]), np.zeros(3), np.eye(6), np.ones(6), np.zeros((3, 6)))
    (told,) = parameters_of(_parameters(found), name).values()
    assert (told.value, told.at_bound) == (value, at_bound)
    assert effect.parameters[0].low <= told.ci95[0] <= told.ci95[1] <= effect.parameters[0].high


@pytest.mark.parametrize(("current_m_s", "lost"), [(0.0, ()), (0.06, tuple(trial.name for trial in trials()))])
def test_swims_that_the_found_effects_explain_are_no_longer_doubted(current_m_s: float, lost: tuple[str, ...]) -> None:
    """The swims have no current: a twin that is carried along does not follow them."""
    current = catalogue()["background_current"].suited(ROBOT, FISHSIM_MARKERS)
    values = np.zeros(len(current.parameters))
    values[0] = current_m_s
    told = replace(Refit.plain(linear()), effects=(current,), values=values)
    assert _not_followed(linear(), told) == lost


@pytest.mark.parametrize(("arm", "grows"), [(ARM, False), (-2 * ARM, True)])
def test_effects_with_which_held_out_swims_are_surely_forecast_worse_are_told(arm: float, grows: bool) -> None:
    effects = (catalogue()["crank_arm_error"],)
    fitted = replace(
        Refit.plain(linear("shorter")), effects=effects, values=np.array([arm]), covariance=np.eye(6) * 1e-8
    )
    gap = HeldOut(linear("shorter"), (trials()[0].with_role("holdout"),), 0).gap(fitted)
    assert gap.grows == grows
    assert (gap.squares_after > gap.squares_before) == grows


def supposed(*names: str) -> WeighedEffects:
    effects = [catalogue()[name] for name in names]
    return weigh_effects(data(), effects, Settings("quick"))


@pytest.mark.long
def test_the_arm_is_borne_out_and_a_bend_beside_it_is_not() -> None:
    found = supposed("crank_arm_error", "bend_offset")

    assert found.log_bayes_factor > 5
    assert found.of_each["crank_arm_error"] > 5
    assert found.of_each["bend_offset"] < 1
    assert found.refit.by_effect["crank_arm_error"] == pytest.approx(ARM, abs=0.006)
    assert found.fitted.with_effects_mm < found.fitted.baseline_mm
    assert found.gap.squares_after < found.gap.squares_before


def test_without_a_fitted_swim_nothing_is_said() -> None:
    with pytest.raises(NotEnoughData, match='no swim of role "fit"'):
        weigh_effects(replace(data(), trials=[]), [])


@pytest.mark.parametrize(("flagged", "verdict"), [("marker_creeps", "unexplained"), *later((None, "no_gap"))])
def test_a_motion_that_features_do_not_show_is_no_missing_gap(flagged: str | None, verdict: str) -> None:
    flags = () if flagged is None else (Flag(flagged),)
    swims = [replace(swim, flags=(*swim.flags, *flags)) for swim in trials()[1:]]
    healthy = SessionData(swims, linear().twin, CAMERA, discrepancy_for(FISHSIM_MARKERS, ROBOT), AT)
    assert diagnose(healthy, {"bend_offset": EFFECTS["bend_offset"]}, Settings("quick")).said.verdict.name == verdict
