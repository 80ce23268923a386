"""Transfer: robots come back as they were made, all arms meet the same starts, shares and ranks are those put in."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.effects.folder import DIAGNOSIS, SuiteFolder
from benchmarks.reality import Nuisances
from benchmarks.reality.mechanisms.outside import CamberedFin
from benchmarks.transfer import laws
from benchmarks.transfer.laws import OnRobot, searched, shipped_law
from benchmarks.transfer.report import pupils, scores_of
from benchmarks.transfer.robots import Robot, load_worlds, plans
from benchmarks.transfer.run import Flock, flocks
from swimgym import Swimmers
from tests.swimgym.fish import fish

SMALL = Path(__file__).parents[3] / "datasets" / "withheld" / "small"
WATER = (0.4, 2.0, 6.0, 4.0, 1.0)


def test_what_acts_in_a_robot_is_what_its_answer_says() -> None:
    robots = {"wfd06ad78": Robot(WATER, Nuisances(), 40.0), "w5789a2fb": Robot(WATER, Nuisances(), 0.0)}
    cambered, plain = load_worlds(SuiteFolder(SMALL), robots, plans(1, "small"))
    (fin,) = cambered.mechanisms
    assert isinstance(fin, CamberedFin)
    assert fin.lift == pytest.approx(-0.008353, abs=1e-6)
    assert plain.mechanisms == ()


def test_candidates_meet_the_same_starts_and_each_robot_gets_a_law_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"GENERATIONS": 1, "CANDIDATES": 3, "SECONDS": 0.2}.items():
        monkeypatch.setattr(laws, name, value)
    made: list[Swimmers] = []

    def make(_generation: int, episodes: int, candidates: int) -> Swimmers:
        made.append(Swimmers(fish().models, 2 * episodes * candidates, workers=1))
        return made[-1]

    found, cost = searched(make, 2)
    assert found.shape == (2, len(shipped_law()))
    assert cost.shape == (2,)
    laps = laws._Laps(made[0], 2, 0.2, 5)
    laps.begin(np.arange(12), np.random.default_rng(0))
    heading, side = laps.swimmers.head[:, 2].reshape(2, 6), laps.task.side.reshape(2, 6)  # type: ignore[attr-defined]
    np.testing.assert_allclose(heading, heading[:, :1] * np.ones(6))
    np.testing.assert_array_equal(side, np.outer([1.0, -1.0], np.ones(6)))


def test_shares_of_the_gap_and_ranks_are_those_put_in(tmp_path: Path) -> None:
    suite, records = SuiteFolder(tmp_path), flocks(SuiteFolder(tmp_path))
    errors = {"shipped": 40.0, "published": 40.0, "calibrated": 20.0, "reality": 10.0}
    for arm, error in errors.items():
        robots = {f"w{i}": swum((error if arm != "calibrated" else error - i) / 1000) for i in range(6)}
        records.keep(f"{arm}-0", Flock(arm, robots | {"lost": OnRobot((0.0,), 0.0, (False,), (0.01,), (0.02,))}))
    for i in range(6):
        (tmp_path / "sessions" / f"w{i}" / "results").mkdir(parents=True)
        made = {"verdict": "named", "groups": [["tendon_slack"]], "probabilities": {}, "gap": {"shrinkage": 0.1 * i}}
        (tmp_path / "sessions" / f"w{i}" / DIAGNOSIS).write_text(json.dumps(made))
    found, lost = pupils(suite)
    assert [pupil.skill for pupil in found] == pytest.approx([0.1 * i for i in range(6)])
    assert lost == ("lost",)
    text = scores_of(suite, "calib benchmark transfer").text()
    share = 100 * np.mean(np.log(40 / (20 - np.arange(6)))) / np.log(4)
    row = next(line for line in " ".join(text.split()).split("- ") if line.startswith("(b)") and "closed" in line)
    assert f"gap closed, % {share:.3g} (" in row
    assert "cheaper than (a) 6 of 6" in row
    assert "| what calibration gains over (a) | 6 | 1 (1 to 1) |" in text
    assert "Left out: lost" in text


def swum(off_m: float) -> OnRobot:
    return OnRobot((0.0,), 0.01, (True, True), (off_m, off_m), (50.0, 50.0))
