"""`calib diagnose`: what it writes, when it is made again, what it refuses."""

import json
import shutil
import sys
from pathlib import Path

import jsonschema
import mujoco
import numpy as np
import pytest

from calib import pipeline
from calib import viewer as recording
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from diagnosis import diagnose as diagnosis
from diagnosis.refit import RidgeFit
from diagnosis.result import DIAGNOSIS, EFFECT_TEST
from diagnosis.verdict import Verdict
from reports.context import ReportContext
from tests.calib.door import ROOT, Front, assert_reports, edit, files_in, results_in, with_little_effort
from tests.once import copied

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


def test_an_effect_that_there_is_not_is_refused_with_the_choices(calib: Front, fresh: Path) -> None:
    assert_reports(calib("diagnose", fresh, "--exclude", "gremlins"), "gremlins", "crank_arm_error", "docs/effects.md")
    assert not (fresh / "results" / "diagnosis.json").exists()


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
