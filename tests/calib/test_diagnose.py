"""`calib diagnose`: what it writes, when it is made again, what it refuses."""

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import jsonschema
import mujoco
import numpy as np
import pytest

from calib import pipeline
from calib import viewer as recording
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from calib.results.gap import diagnosis_lines
from calib.results.gap import test_lines as lines_of_test
from diagnosis import diagnose as diagnosis
from diagnosis.refit import RidgeFit
from diagnosis.result import DIAGNOSIS, EFFECT_TEST, DiagnosisResult, EffectTestResult, Experiment
from diagnosis.verdict import Verdict
from reports.context import ReportContext
from tests.calib.door import ROOT, Front, assert_reports, edit, files_in, results_in, with_little_effort
from tests.once import copied
from tests.reports.diagnoses import made_diagnosed

SCHEMA = ROOT.parent / "shared" / "design" / "schema" / "diagnosis.schema.json"
QUICK = ("--effort", "quick")


@pytest.fixture(scope="module")
def diagnosed_session(finished_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session with a diagnosis of two effects, in which one is named and all are called for whatever the data say."""
    folder = Path(shutil.copytree(finished_session, tmp_path_factory.mktemp("diagnosed") / "pool"))
    with pytest.MonkeyPatch.context() as patch:
        with_little_effort(patch)
        patch.setattr(diagnosis, "MOST_LEFT", 2.0)
        patch.setattr(diagnosis, "ADEQUATE", -1.0)
        patch.setattr(diagnosis, "verdict_of", lambda _found: Verdict("named", (("scale_error",),)))
        patch.setattr(diagnosis, "ALL_AT_ONCE", ("quick",))
        patch.setattr(diagnosis, "ridge_fit", lambda *reported: RidgeFit(0.5, 20.0, reported[3]))
        Pipeline(open_session(folder), Options("quick", workers=1)).diagnosis()
    return folder


diagnosed = copied("diagnosed_session")


def test_it_writes_the_contract_and_the_model_with_the_effect(diagnosed: Path) -> None:
    data = json.loads((diagnosed / "results" / "diagnosis.json").read_text())
    if SCHEMA.exists():
        jsonschema.validate(data, json.loads(SCHEMA.read_text()))
    assert data["effects"] == ["scale_error"]
    assert data["gap"]["evaluated_on"] == ["fast"]
    names = ("calibrated+scale_error", "calibrated+everything")
    assert data["models"] == [f"{name}.{suffix}" for name in names for suffix in ("xml", "py")]
    for name in names:
        model = mujoco.MjModel.from_xml_path(str(diagnosed / "results" / f"{name}.xml"))
        assert model.joint("tail_5").name == "tail_5"


def test_it_tells_what_all_effects_at_once_forecast(diagnosed: Path) -> None:
    reported = DIAGNOSIS.read(diagnosed / "results").everything
    assert reported is not None
    assert reported.share_of_priors == 0.5
    assert {each.effect for each in reported.strengths} == {"scale_error"}
    assert reported.gap.evaluated_on == ("fast",)


def test_what_no_model_can_hold_runs_as_a_script(diagnosed: Path) -> None:
    script = diagnosed / "results" / "calibrated+scale_error.py"
    reported: dict[str, object] = {}
    exec(compile(script.read_text(), str(script), "exec"), reported)
    assert np.isfinite(reported["trajectories"].head).all()  # type: ignore[attr-defined]


def test_what_has_not_changed_is_not_made_again(calib: Front, diagnosed: Path) -> None:
    before = results_in(diagnosed)
    outcome = calib("diagnose", diagnosed, *QUICK)
    assert outcome.code == 0
    assert results_in(diagnosed) == before
    lines = outcome.out.splitlines()
    assert [line.split(":")[0] for line in lines[:3]] == ["Where", "Which", "How far"]
    assert lines[-1] == str(diagnosed / "results" / "diagnosis.json")


@pytest.mark.long
def test_another_catalogue_is_another_diagnosis_which_says_so_everywhere(
    calib: Front, diagnosed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, ReportContext] = {}
    monkeypatch.setattr(pipeline, "write_report", lambda path, context: (seen.update(context=context), path.touch()))
    outcome = calib("diagnose", diagnosed, *QUICK, "--exclude", "scale_error")
    assert outcome.code == 0
    assert "made without scale error" in outcome.out
    assert calib("fit", diagnosed, *QUICK).code == 0
    assert calib("report", diagnosed).code == 0
    found = seen["context"].diagnosed
    assert found is not None
    assert found.withheld_from_catalogue == ("scale_error",)
    assert "scale_error" not in DIAGNOSIS.read(diagnosed / "results").probabilities
    assert not list((diagnosed / "results").glob("calibrated+*"))


@pytest.mark.parametrize("option", ["--exclude", "--test"])
@pytest.mark.parametrize("names", ["", " , "])
def test_an_option_that_names_no_effect_is_refused_with_the_choices(
    calib: Front, fresh: Path, option: str, names: str
) -> None:
    before = files_in(fresh)
    assert_reports(calib("diagnose", fresh, option, names), f"{option}: names no effect; found {names!r}", "wave_drag")
    assert files_in(fresh) == before


def test_a_session_without_fitted_swims_is_refused(calib: Front, fresh: Path) -> None:
    text = (fresh / "session.toml").read_text()
    if 'role = "fit"' in text:
        edit(fresh / "session.toml", 'role = "fit"', 'role = "holdout"')
    assert_reports(calib("diagnose", fresh, *QUICK), 'role = "fit"')


@pytest.mark.long
def test_report_and_recording_show_what_is_missing(
    calib: Front, diagnosed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, object] = {}
    monkeypatch.setattr(pipeline, "write_report", lambda path, context: (seen.update(context=context), path.touch()))
    monkeypatch.setattr(
        recording, "write_recording", lambda path, trials, _name: (seen.update(trials=trials), path.touch())
    )
    assert calib("fit", diagnosed, *QUICK).code == 0
    assert calib("report", diagnosed).code == 0
    assert calib("view", diagnosed).code == 0

    assert list(seen["context"].diagnosed.effect_parameters) == ["scale_error"]  # type: ignore[attr-defined]
    shown = {trial.name: trial.missing is not None for trial in seen["trials"]}  # type: ignore[attr-defined]
    assert shown == {"slow": True, "fast": False}


@pytest.mark.long
def test_what_somebody_supposes_is_weighed_and_changes_no_diagnosis(calib: Front, diagnosed: Path) -> None:
    before = files_in(diagnosed / "results")

    outcome = calib("diagnose", diagnosed, *QUICK, "--test", "crank_arm_error, scale_error", "-v")

    assert outcome.code == 0
    lines = outcome.out.splitlines()
    assert lines[0] == "Tested: crank arm error, scale error."
    assert lines[-1] == str(diagnosed / "results" / "supposed.json")
    data = EFFECT_TEST.read(diagnosed / "results")
    assert list(data.log_bayes_factor_of_each) == ["crank_arm_error", "scale_error"]
    assert data.fitted.with_effects_mm > 0
    assert data.gap.evaluated_on == ("fast",)
    after = files_in(diagnosed / "results")
    assert {name: after[name] for name in before} == before


def test_what_nobody_knows_cannot_be_supposed(calib: Front, diagnosed: Path) -> None:
    outcome = calib("diagnose", diagnosed, *QUICK, "--test", "gremlins,scale_error,elves")
    assert_reports(outcome, "gremlins", "elves", "scale_error")
    assert calib("diagnose", diagnosed, "--test", "scale_error", "--exclude", "wave_drag").code == 2
    assert not (diagnosed / "results" / "supposed.json").exists()


_OPENED: list[Path] | None = None


def _note(event: str, arguments: tuple[object, ...]) -> None:
    if _OPENED is not None and event in ("open", "os.listdir", "os.scandir") and isinstance(arguments[0], (str, Path)):
        _OPENED.append(Path(arguments[0]))


@pytest.mark.long
def test_it_opens_nothing_of_a_suite_but_its_session(
    finished_session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Answers lie next to the sessions as plain files; a diagnosis neither lists nor reads them."""
    folder = Path(shutil.copytree(finished_session, tmp_path / "suite" / "sessions" / "pool"))
    (tmp_path / "suite" / "answers").mkdir()
    (tmp_path / "suite" / "answers" / "pool.json").write_text("{}")
    sys.addaudithook(_note)
    monkeypatch.setitem(globals(), "_OPENED", [])
    with_little_effort(monkeypatch)
    Pipeline(open_session(folder), Options("quick", workers=1)).diagnosis()
    opened = [path for path in _OPENED or () if path.is_relative_to(tmp_path / "suite")]

    assert folder / "results" / "diagnosis.json" in [path.with_name("diagnosis.json") for path in opened]
    assert [path for path in opened if not path.is_relative_to(folder)] == []


CLOCK = "time_base_error"


def checks(data: DiagnosisResult) -> list[str]:
    """Beside that of two swims none can be left out, and that the named effects leave more than noise."""
    always = ("Two trials", "something else is missing")
    return [
        line for line in diagnosis_lines(data) if line.startswith("! ") and not any(each in line for each in always)
    ]


def beating(at: float, verdict: str = "named", named: tuple[str, ...] = (CLOCK,)) -> DiagnosisResult:
    """Tails beat at so much of their command."""
    frequencies = {"medium": {"commanded_hz": 1.0, "measured_hz": at}, "fast": {"commanded_hz": None, "measured_hz": 1}}
    reported = {"groups": [[name] for name in named], "effects": named, "effect_parameters": {}}
    return made_diagnosed(verdict, frequencies=frequencies, **reported)


def test_an_effect_at_its_bound_and_a_shorter_catalogue_are_to_be_checked() -> None:
    bound, lacking = sorted(
        checks(made_diagnosed(withheld_from_catalogue=["scale_error"])), key=lambda x: "made without" in x
    )
    assert "wave drag (high)" in bound
    assert "low" not in bound
    assert "without scale error" in lacking


@pytest.mark.parametrize(("at", "caveat"), [(0.5, "50 % slower"), (1.2, "20 % faster")])
def test_a_clock_or_gear_that_is_far_off_may_be_a_number_of_the_session(at: float, caveat: str) -> None:
    (reported,) = checks(beating(at))
    assert caveat in reported
    assert "fps" in reported
    assert checks(beating(0.97)) == []
    (reported,) = checks(beating(at, "unexplained", ()))
    assert caveat in reported


def test_an_experiment_is_reported_once_with_all_that_it_tells_apart() -> None:
    pairs = {("tendon_slack", "tendon_friction"): 0.1, ("wave_drag", CLOCK): 0.04, ("wave_drag", "tendon_slack"): 0.3}
    experiments = tuple(Experiment("Film a swim at 0.8 Hz", pair, error) for pair, error in pairs.items())
    data = replace(made_diagnosed("inseparable"), next_experiments=experiments)
    reported = [line for line in diagnosis_lines(data) if line.startswith("next: ")]
    assert reported == [
        "next: Film a swim at 0.8 Hz (separates tendon slack from tendon friction, expected error 10%; "
        "wave drag from time base error, expected error 4%)"
    ]


def test_a_supposed_gap_that_grows_is_reported_to_grow() -> None:
    gap = made_diagnosed("named", gap={"shrinkage": -0.04, "shrinkage_ci95": [-0.25, 0.2]}).gap
    reported = EffectTestResult(("wave_drag",), 1.4, {"wave_drag": 1.4}, {}, gap, gap)
    assert lines_of_test(reported)[-1] == "The held-out gap grows by 4 % (95 % interval −20 % to 25 %)."
