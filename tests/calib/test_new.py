"""`calib new`: sessions from public tracks and from the twin."""

from pathlib import Path

import pytest

from calib.pipeline import open_session
from swimcal.robot import load_robot
from swimsynth.session import read_truth
from tests.calib.door import PLAN, ROOT, Front, assert_reports
from tests.swimcal.sample import FISHSIM, needs_fishsim


@needs_fishsim
def test_public_tracks_become_a_session(calib: Front, tmp_path: Path) -> None:
    outcome = calib("new", tmp_path / "s", "--from-fishsim", FISHSIM, "--fit", "f1_00, f1_75")

    assert (outcome.code, outcome.out) == (0, f"{tmp_path / 's'}\n")
    session = open_session(tmp_path / "s")
    assert {t.name: t.role for t in session.trials} == {
        "f0_50": "holdout",
        "f0_75": "holdout",
        "f1_00": "fit",
        "f1_25": "holdout",
        "f1_75": "fit",
    }


def tracks_of_a_checkout(folder: Path) -> Path:
    """As in the authors' repository: `Data/Markers/markers_f1_00.csv`."""
    place = folder / "Data" / "Markers"
    place.mkdir(parents=True)
    row = ",".join(f"{100 + 40 * k}.0,{200 + k}.5" for k in range(9))
    (place / "markers_f1_00.csv").write_text(f"{row}\n" * 90)
    return folder


def test_a_trial_to_fit_that_is_not_there_is_refused_and_nothing_made(calib: Front, tmp_path: Path) -> None:
    source = tracks_of_a_checkout(tmp_path / "fishsim")

    assert_reports(calib("new", tmp_path / "s", "--from-fishsim", source, "--fit", "f1_0"), "'f1_0'", "choices: f1_00")
    assert not (tmp_path / "s").exists()


def test_a_synthetic_session_comes_with_its_truth_and_its_seed(
    calib: Front, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "swimsynth.plan.default_plan", lambda seed, robot: PLAN.model_copy(update={"seed": seed, "robot": robot})
    )
    assert calib("new", tmp_path / "s", "--synthetic", "--seed", "5").code == 0

    assert open_session(tmp_path / "s").name == "synthetic"
    assert read_truth(tmp_path / "s").plan.seed == 5


def test_a_robot_that_is_not_there_is_told_before_anything_is_simulated(calib: Front, tmp_path: Path) -> None:
    outcome = calib("new", tmp_path / "s", "--synthetic", "--robot", tmp_path / "nowhere.toml")

    assert_reports(outcome, "nowhere.toml")
    assert "simulating" not in outcome.err
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("options", [[], ["--synthetic", "--from-fishsim", "x"]])
def test_it_is_reported_to_make_one_of_both(calib: Front, tmp_path: Path, options: list[str]) -> None:
    outcome = calib("new", tmp_path / "s", *options)

    assert outcome.code == 2
    assert "--from-fishsim DIR" in outcome.err
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("robot", ["three_link", "seven_link"])
def test_a_synthetic_session_is_of_the_robot_that_was_given(calib: Front, tmp_path: Path, robot: str) -> None:
    file = ROOT / "tests" / "swimcal" / "robots" / f"{robot}.toml"
    assert calib("new", tmp_path / "s", "--synthetic", "--robot", file).code == 0

    session, expected = open_session(tmp_path / "s"), load_robot(file)
    assert load_robot(session.robot_file) == expected
    assert session.markers == tuple(expected.markers)
    assert {trial.kind for trial in session.trials} == {"swim", "dry", "free_decay"}
    decays = read_truth(tmp_path / "s").plan.free_decays
    assert [len(decay.bent_rad) for decay in decays] == [len(expected.hinges)] * 3


@pytest.mark.parametrize(
    ("options", "faults"),
    [
        (("--synthetic", "--fps", "30", "--fit", "f0_40"), ("--fps", "--fit")),
        (("--from-fishsim", "x", "--robot", "six.toml", "--seed", "3"), ("--robot", "--seed")),
        (("--tracks", "f1_00.csv", "--seed", "3"), ("--seed",)),
        (("--synthetic", "--from-fishsim", "x", "--commands", "1,2"), ("several sources of trials", "--commands")),
    ],
)
def test_options_that_do_not_go_together_are_reported_at_once(
    calib: Front, tmp_path: Path, options: tuple[str, ...], faults: tuple[str, ...]
) -> None:
    outcome = calib("new", tmp_path / "s", *options)

    assert_reports(outcome, *(f"{fault}: means nothing with" for fault in faults if fault.startswith("--")))
    assert_reports(outcome, *faults)
    assert not (tmp_path / "s").exists()
