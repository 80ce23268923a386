"""Transfer: robots come back as they were made, all arms meet the same starts, shares and ranks are those put in."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.effects.folder import DIAGNOSIS, SuiteFolder
from benchmarks.reality import Nuisances
from benchmarks.reality.mechanisms.outside import CamberedFin
from benchmarks.transfer import laws
from benchmarks.transfer.laws import OnRobot, TaskPlan, searched, shipped_law
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


@pytest.mark.parametrize("task", ["circle", "target"])
def test_candidates_meet_the_same_starts_and_each_robot_gets_a_law_of_its_own(
    task: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in {"GENERATIONS": 1, "CANDIDATES": 3}.items():
        monkeypatch.setattr(laws, name, value)
    monkeypatch.setitem(laws.TASKS, task, TaskPlan(2, 0.2, 1, 0.2))
    made: list[Swimmers] = []

    def make(_generation: int, episodes: int, candidates: int) -> Swimmers:
        made.append(Swimmers(fish().models, 2 * episodes * candidates, workers=1))
        return made[-1]

    found, cost = searched(make, task, 2)
    assert found.shape == (2, len(shipped_law(task)))
    assert cost.shape == (2,)
    course = laws._Episodes(made[0], task, 2, 0.2, 5)
    seen = course.begin(np.arange(12), np.random.default_rng(0)).reshape(2, 6, -1)
    np.testing.assert_allclose(seen, seen[:, :1] * np.ones((6, 1)))
    assert np.linalg.norm(seen[0, 0] - seen[1, 0]) > 0.05


def test_shares_of_the_gap_and_ranks_are_those_put_in(tmp_path: Path) -> None:
    suite, records = SuiteFolder(tmp_path), flocks(SuiteFolder(tmp_path))
    errors = {"shipped": 40.0, "published": 40.0, "calibrated": 20.0, "reality": 10.0}
    for arm, error in errors.items():
        robots = {f"w{i}": swum((error if arm != "calibrated" else error - i) / 1000) for i in range(6)}
        records.keep(
            f"{arm}-0", Flock("circle", arm, robots | {"lost": OnRobot((0.0,), 0.0, (False,), (0.01,), (0.02,))})
        )
    for i in range(6):
        (tmp_path / "sessions" / f"w{i}" / "results").mkdir(parents=True)
        made = {"verdict": "named", "groups": [["tendon_slack"]], "probabilities": {}, "gap": {"shrinkage": 0.1 * i}}
        (tmp_path / "sessions" / f"w{i}" / DIAGNOSIS).write_text(json.dumps(made))
    found, lost = pupils(suite, "circle")
    assert [pupil.skill for pupil in found] == pytest.approx([0.1 * i for i in range(6)])
    assert lost == ("lost",)
    text = scores_of(suite, "circle").text()
    share = 100 * np.mean(np.log(40 / (20 - np.arange(6)))) / np.log(4)
    row = next(line for line in " ".join(text.split()).split("- ") if line.startswith("(b)") and "closed" in line)
    assert f"gap closed, % {share:.3g} (" in row
    assert "better than (a) 6 of 6" in row
    assert "| what calibration gains over (a) | 6 | 1 (1 to 1) |" in text
    assert "Left out: lost" in text


def test_of_targets_the_time_counts_and_a_missed_one_costs_the_whole_episode(tmp_path: Path) -> None:
    records = flocks(SuiteFolder(tmp_path))
    for arm, seconds in {"shipped": 40.0, "published": 40.0, "calibrated": 20.0, "reality": 10.0}.items():
        hit, missed = (
            OnRobot((0.0,), 0.0, (True, reached), (np.nan,) * 2, (seconds, 9.0)) for reached in (True, False)
        )
        records.keep(f"target-{arm}-0", Flock("target", arm, {"hit": hit, "missed": missed}))
        records.keep(f"circle-{arm}-0", Flock("circle", arm, {"other": swum(0.02)}))
    found, _ = pupils(SuiteFolder(tmp_path), "target")
    assert [pupil.success("calibrated") for pupil in found] == [1.0, 0.5]
    assert [np.exp(pupil.log_cost("calibrated")) for pupil in found] == pytest.approx([14.5, 40.0])
    text = scores_of(SuiteFolder(tmp_path), "target").text()
    assert "| (b) calibrated twin | 2 | 75 |" in text
    assert "better than (a)" in text


def swum(off_m: float) -> OnRobot:
    return OnRobot((0.0,), 0.01, (True, True), (off_m, off_m), (50.0, 50.0))
