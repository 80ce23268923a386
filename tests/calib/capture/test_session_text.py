import tomllib
from pathlib import Path

import pytest

from calib.capture import UserError
from calib.capture.logs import MOTOR_HEADER, SessionText
from swimcal.robot import load_robot
from swimcal.session import load_session


def a_log(folder: Path, name: str) -> None:
    (folder / "trials" / f"{name}.motor.csv").write_text(f"{MOTOR_HEADER}\n1,0,0,0,12,30,0\n2,0,0,0,12,30,0\n")


def test_a_session_that_is_not_there_is_made_and_is_valid(tmp_path: Path) -> None:
    text = SessionText(tmp_path / "a" / 'pool "ü" 1')
    text.make_folders()
    for name, kind, hz, role in (("f0_60", "swim", 0.6, "holdout"), ("f0_80", "dry", 0.8, "fit")):
        a_log(text.folder, name)
        text.add_trial(name, kind, hz, role)
    session = load_session(text.folder, load_robot)
    assert session.name == 'pool "ü" 1'
    assert [(t.name, t.kind, t.commanded_hz) for t in session.trials] == [("f0_60", "swim", 0.6), ("f0_80", "dry", 0.8)]
    assert [t.role for t in session.trials] == ["holdout", "fit"]
    assert session.trials[0].motor == text.folder / "trials/f0_60.motor.csv"
    assert sorted(path.name for path in text.folder.iterdir()) == ["session.toml", "trials"]


@pytest.mark.parametrize("end", ["", "\n", "\n\n# the end\n", "\r\n"])
def test_what_the_user_wrote_stays_as_it_was(tmp_path: Path, end: str) -> None:
    old = '# mine\n[session]\nname="x"\n[[trial]]\nname = "f0_60" # slow\nkind = "swim"' + end
    (tmp_path / "session.toml").write_bytes(old.encode())
    text = SessionText(tmp_path)
    text.make_folders()
    assert text.taken_names() == ["f0_60"]
    text.add_trial("f0_80", "dry", 0.8, "fit")
    new = (tmp_path / "session.toml").read_bytes().decode()
    assert new.startswith(old.rstrip("\n"))
    assert [trial["name"] for trial in tomllib.loads(new)["trial"]] == ["f0_60", "f0_80"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"[session", "not valid TOML"),
        (b"trial = [{name = 'a'}]", "no trial can be appended"),
        (b"trial = 3", "no trial can be appended"),
        (b"\xff", "cannot be read"),
    ],
)
def test_a_session_that_cannot_be_added_to_is_refused_before_anything_is_driven(
    tmp_path: Path, content: bytes, message: str
) -> None:
    (tmp_path / "session.toml").write_bytes(content)
    with pytest.raises(UserError, match=message):
        SessionText(tmp_path).check()
    assert (tmp_path / "session.toml").read_bytes() == content


def test_a_place_that_is_no_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        SessionText(tmp_path / "file").make_folders()
