from pathlib import Path

import av
import numpy as np
import pytest

from benchmarks.gym import RATIO, measure_gym
from swimgym.aquarium import FPS, play, swim_together, write_shoal
from swimgym.course import make_course
from swimgym.swimmers import Swimmers
from tests.calib.door import Front, front_door
from tests.swimgym.fish import fish, session_with_fit
from tests.swimgym.test_policies import policy


@pytest.fixture
def calib(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Front:
    return front_door(monkeypatch, capsys)


@pytest.mark.parametrize("kind", ["rrd", "mp4", "gif"])
def test_a_shoal_is_filmed_without_a_screen(kind: str, tmp_path: Path) -> None:
    shoal, file = swim_together(fish(), 5, 0.4, policy=policy()), tmp_path / f"pool.{kind}"
    write_shoal(shoal, file)
    assert shoal.lines_m.shape[:2] == (round(0.4 * FPS), 5)
    assert shoal.in_real_time > 0
    if kind == "rrd":
        assert file.read_bytes()[:4] == b"RRF2"
        return
    with av.open(str(file)) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(frames) == len(shoal.lines_m)
    np.testing.assert_allclose(frames[0][0, 0], (214, 232, 240), atol=4)  # water
    assert any((frame != frames[0]).any() for frame in frames)


def test_a_fish_is_drawn_from_nose_to_tip() -> None:
    swimmers = Swimmers(fish().models, 1, workers=1)
    swimmers.rest(np.arange(1), np.zeros((1, 2)))
    line = swim_together(fish(), 1, 0.1).lines_m[0, 0]
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert length == pytest.approx(swimmers.joints_m[-1] - swimmers.joints_m[0])


def test_an_episode_is_filmed_as_it_was_swum(tmp_path: Path) -> None:
    course = make_course("target", 1, fish=fish(), workers=1)
    swum, shoal = play(course, policy().act, (-0.4, 0.0))
    assert swum.reached[0]
    assert len(shoal.lines_m) == pytest.approx(swum.seconds[0] * FPS, abs=1)
    write_shoal(shoal, tmp_path / "reach.mp4")


def test_the_commands_go_from_a_session_to_a_film(tmp_path: Path, calib: Front) -> None:
    pool, film = session_with_fit(tmp_path / "pool"), tmp_path / "film.gif"
    assert calib("aquarium", pool, "--swimmers", "4", "--seconds", "0.2", "--out", film).code == 0
    policy().save(pool / "results" / "policy" / "target.npz")
    scored = calib("policy", "evaluate", pool, "--episodes", "3")
    assert scored.code == 0
    assert "search: 100.0% of 3 reached" in scored.out
    assert calib("policy", "play", pool, "--target=-0.4,0", "--out", film).code == 0


def test_bad_input_gets_one_error(tmp_path: Path, calib: Front) -> None:
    pool = session_with_fit(tmp_path / "pool")
    for arguments, expected in {
        ("aquarium", pool, "--out", "pool.avi"): "choices: .rrd, .mp4, .gif",
        ("policy", "evaluate", pool): "there is no such policy",
        ("policy", "train", tmp_path): "calibration.json",
    }.items():
        outcome = calib(*arguments)
        assert outcome.code == 2
        assert expected in outcome.err
    policy().save(pool / "results" / "policy" / "target.npz")
    other = calib("policy", "play", pool, "--task", "circle", "--policy", pool / "results" / "policy" / "target.npz")
    assert (other.code, "a policy of another task" in other.err) == (2, True)


@pytest.mark.long
def test_the_batch_is_faster_than_processes() -> None:
    assert measure_gym(fish=fish())[RATIO] > 1  # 7 on an idle machine; beside others, processes get more of it
