"""Nothing about the files of a suite but what the tracks and logs say tells what is in a session."""

from __future__ import annotations

import gzip
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import cross_val_predict

from benchmarks.effects.drawn import draw_world
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.making import write_session
from benchmarks.effects.suite import SessionPlan, SuiteSize, plan_suite
from benchmarks.reality.mechanisms import CATALOGUED, EVERY, FAMILIES, OUTSIDE
from swimcal.session import load_session
from tests.benchmarks.effects.suites import shortened

SIZE = SuiteSize(90, 45)
TOGETHER = 16  # sessions under way at a time, in the company of others as in a suite
STRENGTH = 2.0  # twice what is typical: what an effect gives away, it gives away more of
FAMILY = {name: family for family, names in FAMILIES.items() for name in names}

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def plans() -> tuple[SessionPlan, ...]:
    """Of unequal lengths, as those of a suite."""
    every = plan_suite(5, SIZE, tuple(CATALOGUED), tuple(OUTSIDE))
    return tuple(shortened(plan, seconds=1.6 + 0.1 * (plan.seed % 8)) for plan in every)


@pytest.fixture(scope="module")
def folder(plans: tuple[SessionPlan, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Written as a suite is, but for the search of the severity, which leaves no trace in the files."""
    folder, mechanisms = tmp_path_factory.mktemp("suite"), EVERY

    def made(plan: SessionPlan) -> Filming[None]:
        drawn, random = (yield from draw_world(plan)), np.random.default_rng([plan.seed, 3])
        present = tuple(m for name in plan.effects for m in mechanisms[name](random)(STRENGTH))
        tries = 0 if plan.kind == "null" else 1  # a severity is searched for: such sessions are filmed later
        for _ in range(tries):
            yield from drawn.recorded(present, drawn.swims("fit"))
        recordings = yield from drawn.recorded(present)
        write_session(folder / "sessions" / plan.name, drawn, recordings)

    film_together((made(plan) for plan in plans), TOGETHER)
    return folder


def traces(folder: Path, number: int, plan: SessionPlan) -> list[float]:
    """Numbers of all that can be seen without reading a number of tracks or logs."""
    session = folder / "sessions" / plan.name
    files = sorted(path for path in session.rglob("*") if path.is_file())
    packed = [path for path in files if path.suffix == ".gz"]
    reported = [path.read_bytes() for path in files if path.name.endswith(".motor.csv")]
    rows = [gzip.decompress(path.read_bytes()).count(b"\n") for path in packed]
    offsets = [trial.motor_offset_s or 0.0 for trial in load_session(session).trials]
    return [
        number,
        int(plan.name[1:], 16),
        len(files),
        *(path.stat().st_size for path in packed),
        *rows,
        sum(map(len, reported)),
        sum(text.count(b"\n") for text in reported),
        float(np.mean(offsets)),
        (session / "session.toml").stat().st_size,
        *(path.stat().st_mtime for path in (session, session / "trials", *packed)),
        *(sha256(path.read_bytes()).digest()[0] for path in (*packed, session / "session.toml")),
        *(packed[0].read_bytes()[:10]),
    ]


@pytest.fixture(scope="module")
def seen(folder: Path, plans: tuple[SessionPlan, ...]) -> np.ndarray:
    return np.array([traces(folder, number, plan) for number, plan in enumerate(plans)])


def area(seen: np.ndarray, true: np.ndarray) -> float:
    """Under the curve of a cross-validated forest; 0.5 is chance."""
    forest = RandomForestClassifier(300, min_samples_leaf=3, random_state=0)
    folds = int(min(9, true.sum(), (~true).sum()))
    reported = cross_val_predict(forest, seen, true, cv=folds, method="predict_proba")[:, 1]
    return float(roc_auc_score(true, reported))


def within_chance(seen: np.ndarray, true: np.ndarray) -> bool:
    """Whether the area is within three standard errors (Mann and Whitney 1947) of chance."""
    right, wrong = int(true.sum()), int((~true).sum())
    return bool(abs(area(seen, true) - 0.5) < 3 * np.sqrt((right + wrong + 1) / (12 * right * wrong)))


@pytest.fixture(scope="module")
def null(plans: tuple[SessionPlan, ...]) -> np.ndarray:
    return np.array([plan.kind == "null" for plan in plans])


def test_files_do_not_tell_whether_anything_is_present(seen: np.ndarray, null: np.ndarray) -> None:
    assert within_chance(seen, null)


@pytest.mark.parametrize("family", ["measurement", "drive", "tendons", "structure", "fluid"])
def test_files_do_not_tell_its_family(
    seen: np.ndarray, null: np.ndarray, plans: tuple[SessionPlan, ...], family: str
) -> None:
    """Among the sessions with something in them: is any of it of this family?"""
    true = np.array([family in {FAMILY.get(name) for name in plan.effects} for plan in plans])
    assert within_chance(seen[~null], true[~null])


def test_tracks_and_logs_are_as_long_as_was_planned(folder: Path, plans: tuple[SessionPlan, ...]) -> None:
    for plan in plans:
        seconds, trials = plan.recorded.seconds, folder / "sessions" / plan.name / "trials"
        for path in trials.glob("*.csv.gz"):
            assert gzip.decompress(path.read_bytes()).count(b"\n") == round(60 * seconds) + 2
        for path in trials.glob("*.motor.csv"):
            times_s = np.genfromtxt(path, delimiter=",", names=True, comments=None)["time_s"]
            assert np.ptp(times_s) == pytest.approx(seconds, abs=0.021)


def test_what_gives_it_away_is_seen(seen: np.ndarray, null: np.ndarray, plans: tuple[SessionPlan, ...]) -> None:
    """The check can fail: with the length of the names of what is present, it does."""
    said = [len(repr(plan.effects)) for plan in plans]
    assert not within_chance(np.column_stack([seen, said]), null)


def test_sizes_rows_heads_and_times_are_those_of_every_session(folder: Path) -> None:
    packed = list(folder.rglob("*.csv.gz"))
    assert len({path.stat().st_size for path in packed}) == 1
    plain = [gzip.decompress(path.read_bytes()) for path in packed]
    assert len({text.splitlines()[0] for text in plain}) == 1
    assert len({path.stat().st_mtime for path in (folder / "sessions").rglob("*")}) == 1
