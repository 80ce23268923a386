"""Arguments of the Python functions that mean nothing get one clear error, before anything is done."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import calib
from calib.results.twin import SwimTwin
from swimcal.errors import InputError

NO_FREQUENCY = r"frequency_hz: no frequency; found an empty list"


@pytest.fixture(scope="module")
def twin() -> SwimTwin:
    return calib.load_twin()


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: calib.run([]), "sessions: no session; found an empty list"),
        (lambda: calib.report([]), "sessions: no session; found an empty list"),
        (lambda: calib.run(["pool"], jobs=0), "jobs: no number of sessions at a time; found 0"),
        (lambda: calib.run(["pool"], effort="fast"), "effort: no such effort; found 'fast'"),  # type: ignore[arg-type]
        (lambda: calib.fit(None), "session: no session; found None"),  # type: ignore[arg-type]
        (lambda: calib.fit(5), "session: no session; found 5"),  # type: ignore[arg-type]
        (lambda: calib.load_twin(coefficients=[1, 2, 3]), "coefficients: no coefficients of the fluid forces"),
        (lambda: calib.load_twin(coefficients=[-0.4, 2, 6, 4, 1]), r"found \[-0.4, 2, 6, 4, 1\]"),
        (lambda: calib.load_twin(coefficients=[float("nan"), 2, 6, 4, 1]), "five numbers of 0 or more: blunt drag"),
        (lambda: calib.load_twin(effects="tendon_slick"), "'tendon_slick'.*tendon_slack"),
        (lambda: calib.load_tracks("nothing.csv", ["nose"], fps=-3), "--fps: not a frame rate; found -3"),
        (lambda: calib.convert_tracks("nothing.csv", "out.h5", "deeplabcut"), "--out: HDF5 is not written"),
    ],
)
def test_what_means_nothing_is_refused(
    call: Callable[[], object], match: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=match):
        call()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"frequency_hz": []}, NO_FREQUENCY),
        ({"frequency_hz": [1.0], "seconds": 0}, "seconds: no duration; found 0"),
        ({"frequency_hz": 1.0, "seconds": -1}, "seconds: no duration; found -1"),
        ({"frequency_hz": 1.0, "fps": -60}, "fps: no frame rate; found -60"),
        ({"frequency_hz": 1.0, "fps": float("nan")}, "fps: no frame rate; found nan"),
        ({"frequency_hz": "fast"}, "frequency_hz: no frequency; found fast"),
    ],
)
def test_swims_that_cannot_be_are_refused(twin: SwimTwin, arguments: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        twin.swim(**arguments)


def test_one_session_and_one_effect_need_no_list(finished: Path) -> None:
    assert list(calib.compare(finished).index.get_level_values("session").unique()) == ["synthetic"]
    assert calib.load_twin(effects="tendon_slack").parameters


def test_tracks_of_no_trial_are_refused_with_the_choices(finished: Path) -> None:
    with pytest.raises(InputError, match=r"trial: no tracks of this trial; found 'f1_25'.*slow"):
        _ = calib.track(finished, progress=False)["f1_25"]


@pytest.mark.parametrize("hz", [-1.0, 0.0, float("nan")])
def test_a_command_that_is_none_is_refused_before_there_is_a_session(fresh: Path, tmp_path: Path, hz: float) -> None:
    tracks = next((fresh / "trials").glob("*.csv.gz"))
    with pytest.raises(InputError, match="--commands: not a command"):
        calib.new_session(tmp_path / "new", tracks=[tracks], commands_hz=[hz])
    assert not (tmp_path / "new").exists()


def test_a_folder_in_use_is_refused_before_anything_is_simulated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    monkeypatch.setattr("swimsynth.session.make_session", lambda *_: pytest.fail("simulated"))
    with pytest.raises(InputError, match="cannot make a session here"):
        calib.new_session(tmp_path, synthetic=True, progress=False)
