from pathlib import Path

import pytest

from swimcal.stage import Stage, fingerprint_of


def stage(target: Path, fingerprint: str) -> Stage:
    return Stage(target, {}, {"made from": fingerprint})


@pytest.fixture
def target(tmp_path: Path) -> Path:
    path = tmp_path / "results" / "calibration.json"
    path.parent.mkdir()

    def make() -> tuple[Path, ...]:
        path.write_text("{}")
        path.with_name("calibrated.xml").write_text("<mujoco/>")
        return (path.with_name("calibrated.xml"),)

    assert stage(path, "now").ensure(make)
    return path


def test_a_result_is_current_for_its_fingerprint_only(target: Path) -> None:
    assert stage(target, "now").is_current
    assert not stage(target, "later").is_current
    assert not stage(target.with_name("diagnosis.json"), "now").is_current


def test_what_is_current_is_not_made_again(target: Path) -> None:
    def never() -> None:
        raise AssertionError

    assert not stage(target, "now").ensure(never)


@pytest.mark.parametrize("name", ["calibration.json", "calibrated.xml"])
def test_an_edited_or_deleted_output_is_not_current(target: Path, name: str) -> None:
    output = target.with_name(name)
    before = output.read_bytes()
    output.write_bytes(before + b" ")
    assert not stage(target, "now").is_current
    output.write_bytes(before)
    assert stage(target, "now").is_current
    output.unlink()
    assert not stage(target, "now").is_current


@pytest.mark.parametrize("damage", ["{", "[]", '{"calibration.json": 3}', '{"calibration.json": {}}'])
def test_a_damaged_record_makes_everything_again(target: Path, damage: str) -> None:
    (target.parent / ".stages.json").write_text(damage)
    assert not stage(target, "now").is_current
    stage(target, "now").mark()
    assert stage(target, "now").is_current


def test_results_in_subfolders_share_the_record(target: Path) -> None:
    tracks = target.parent / "tracks" / "slow.csv"
    tracks.parent.mkdir()
    tracks.write_text("1")
    stage(tracks, "a").mark()
    assert stage(tracks, "a").is_current
    assert stage(target, "now").is_current
    with pytest.raises(ValueError, match="is not in a session's results folder"):
        assert stage(target.parents[1] / "slow.csv", "a").is_current


def test_the_fingerprint_follows_all_it_is_made_of_and_not_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    base = fingerprint_of({"a": "1", "b": "2"}, {"seed": 0, "effort": "quick"}, ["x", "y"])
    assert base == fingerprint_of({"b": "2", "a": "1"}, {"effort": "quick", "seed": 0}, ["y", "x"])
    others = {
        fingerprint_of({"a": "1", "b": "3"}, {"seed": 0, "effort": "quick"}, ["x", "y"]),
        fingerprint_of({"a": "1", "b": "2"}, {"seed": 1, "effort": "quick"}, ["x", "y"]),
        fingerprint_of({"a": "1", "b": "2"}, {"seed": 0, "effort": "quick"}, ["x"]),
    }
    monkeypatch.setattr("swimcal.stage.program_version", lambda: "swimcal 9")
    others.add(fingerprint_of({"a": "1", "b": "2"}, {"seed": 0, "effort": "quick"}, ["x", "y"]))
    assert len(others | {base}) == 5


def test_what_others_take_the_place_of_is_kept_aside(target: Path) -> None:
    """The result and what was made with it stand there as well until they are replaced; what rests on them is moved."""
    draws = target.with_name("posterior.nc")
    upon = stage(draws, "now")
    assert upon.ensure(lambda: draws.write_text("draws") and None)
    folder = stage(target, "later").keep_aside([draws])
    assert folder == target.parent / "kept" / stage(target, "now").fingerprint[:8]
    assert {path.name for path in folder.iterdir()} == {"calibration.json", "calibrated.xml", "posterior.nc"}
    assert stage(target, "now").is_current
    assert not draws.exists()
    assert not upon.is_current
    assert stage(target.with_name("diagnosis.json"), "now").keep_aside() is None
