from pathlib import Path

import pytest

from session import fingerprint_of, is_current, mark_current


@pytest.fixture
def target(tmp_path: Path) -> Path:
    path = tmp_path / "results" / "calibration.json"
    path.parent.mkdir()
    path.write_text("{}")
    (path.parent / "calibrated.xml").write_text("<mujoco/>")
    mark_current(path, "now", [path.parent / "calibrated.xml"])
    return path


def test_a_marked_result_is_current_for_its_fingerprint_only(target: Path) -> None:
    assert is_current(target, "now")
    assert not is_current(target, "later")
    assert not is_current(target.with_name("diagnosis.json"), "now")


@pytest.mark.parametrize("name", ["calibration.json", "calibrated.xml"])
def test_an_edited_or_deleted_output_is_not_current(target: Path, name: str) -> None:
    output = target.with_name(name)
    before = output.read_bytes()
    output.write_bytes(before + b" ")
    assert not is_current(target, "now")
    output.write_bytes(before)
    assert is_current(target, "now")
    output.unlink()
    assert not is_current(target, "now")


@pytest.mark.parametrize("damage", ["{", "[]", '{"calibration.json": 3}', '{"calibration.json": {}}'])
def test_a_damaged_record_makes_everything_again(target: Path, damage: str) -> None:
    (target.parent / ".stages.json").write_text(damage)
    assert not is_current(target, "now")
    mark_current(target, "now")
    assert is_current(target, "now")


def test_results_in_subfolders_share_the_record(target: Path) -> None:
    tracks = target.parent / "tracks" / "slow.csv"
    tracks.parent.mkdir()
    tracks.write_text("1")
    mark_current(tracks, "a")
    assert is_current(tracks, "a")
    assert is_current(target, "now")
    with pytest.raises(ValueError, match="is not in a session's results folder"):
        is_current(target.parents[1] / "slow.csv", "a")


def test_the_fingerprint_follows_all_it_is_made_of_and_not_their_order() -> None:
    base = fingerprint_of({"a": "1", "b": "2"}, {"seed": 0, "effort": "quick"}, ["x", "y"])
    assert base == fingerprint_of({"b": "2", "a": "1"}, {"effort": "quick", "seed": 0}, ["y", "x"])
    others = {
        fingerprint_of({"a": "1", "b": "3"}, {"seed": 0, "effort": "quick"}, ["x", "y"]),
        fingerprint_of({"a": "1", "b": "2"}, {"seed": 1, "effort": "quick"}, ["x", "y"]),
        fingerprint_of({"a": "1", "b": "2"}, {"seed": 0, "effort": "quick"}, ["x"]),
        fingerprint_of({"a": "1", "b": "2"}, {"seed": 0, "effort": "quick"}, ["x", "y"], "swimcal 9"),
    }
    assert len(others | {base}) == 5
