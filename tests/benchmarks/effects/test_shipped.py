"""The small suite that is shipped: whole, and what its seed gives."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from benchmarks.effects.drawn import draw_world
from benchmarks.effects.filming import film_together
from benchmarks.effects.folder import Answer, SuiteFolder
from benchmarks.effects.making import GENERATORS, Making, write_session
from benchmarks.effects.shipped import SEED, checksum_of_sessions
from benchmarks.effects.suite import SIZES
from benchmarks.reality.mechanisms import OUTSIDE
from diagnosis.discrepancy import discrepancy_for
from swimcal import robot as of_robots
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.robot import load_robot
from swimcal.session import load_session
from swimcal.tracks import load_tracks, pixels_of

FOLDER = Path(__file__).parents[3] / "datasets" / "withheld"
SUITE = SuiteFolder(FOLDER / "small")
PLANS = {plan.name: plan for plan in GENERATORS[SIZES["small"].generator].plan(SEED, SIZES["small"])}


@pytest.fixture(scope="module")
def answers() -> dict[str, Answer]:
    """Opened: each must have the checksum that was published."""
    return {answer.session: answer for answer in SUITE.true()}


@pytest.fixture
def of_then(monkeypatch: pytest.MonkeyPatch) -> None:
    """The built-in robot is that of the sessions."""
    robot = load_robot(SUITE.sessions / min(PLANS) / "robot.toml")
    monkeypatch.setattr(of_robots, "_default_robot", lambda: robot)


def files() -> list[Path]:
    return sorted(path for path in SUITE.sessions.rglob("*") if path.is_file() and "results" not in path.parts)


def test_the_seed_gives_these_sessions_and_answers(answers: dict[str, Answer]) -> None:
    assert {path.name for path in SUITE.sessions.iterdir()} == set(PLANS) == set(answers)
    for name, plan in PLANS.items():
        present = (answers[name].outside,) if plan.kind == "outside" else answers[name].effects
        assert (answers[name].kind, present) == (plan.kind, plan.effects)


def test_one_session_holds_a_pair_that_its_data_cannot_tell_apart(answers: dict[str, Answer]) -> None:
    """A clock that is off beats as a gear does: it is clear that it is one of these two, and not which."""
    pairs = {(*answer.effects, *rivals) for answer in answers.values() for rivals in answer.alike if len(rivals) == 1}
    assert ("time_base_error", "drive_ratio_error") in pairs


@pytest.mark.long
def test_every_session_holds_what_was_planned() -> None:
    for name, plan in PLANS.items():
        session, recorded = load_session(SUITE.sessions / name), plan.recorded
        swims = [trial for trial in session.trials if trial.kind == "swim"]
        for role, speeds in (("fit", recorded.fit_hz), ("holdout", recorded.holdout_hz)):
            assert [trial.commanded_hz for trial in swims if trial.role == role] == list(speeds)
        others = sorted(trial.kind for trial in session.trials if trial.kind != "swim")
        assert others == ["dry"] * (recorded.dry_hz is not None) + ["free_decay"] * recorded.free_decay
        assert {trial.motor is not None for trial in swims} == {recorded.logged}
        assert swims[0].tracks is not None
        tracks = load_tracks(swims[0].tracks, session.markers, session.camera.fps)
        assert np.isfinite(pixels_of(tracks)).all()
        assert np.ptp(tracks.time.values) >= recorded.seconds - 1 / session.camera.fps


@pytest.mark.long
@pytest.mark.usefixtures("of_then")
def test_the_seed_gives_these_tracks(tmp_path: Path) -> None:
    """Of the null session that is made fastest: whoever changes what is drawn has to ship the suite anew."""
    nulls = [plan for plan in PLANS.values() if plan.kind == "null"]
    plan = min(nulls, key=lambda each: len((*each.recorded.fit_hz, *each.recorded.holdout_hz)))
    (drawn,) = film_together([draw_world(plan)])
    write_session(tmp_path / plan.name, drawn, film_together([drawn.recorded()])[0])
    shipped = load_session(SUITE.sessions / plan.name)
    for trial, made in zip(shipped.trials, load_session(tmp_path / plan.name).trials, strict=True):
        assert trial.tracks is not None
        assert made.tracks is not None
        found = pixels_of(load_tracks(made.tracks, shipped.markers, shipped.camera.fps))
        off = np.abs(found - pixels_of(load_tracks(trial.tracks, shipped.markers, shipped.camera.fps)))
        assert (off > 0).mean() < 1e-3  # samples on the edge between two places of the grid
        assert off.max() <= 0.5


@pytest.mark.long
@pytest.mark.usefixtures("of_then")
def test_the_seed_gives_this_answer(answers: dict[str, Answer], tmp_path: Path) -> None:
    """Of the clear effect whose session is made fastest: whoever changes severities or the oracle has to ship anew."""
    clear = [plan for plan in PLANS.values() if plan.kind == "single" and answers[plan.name].detectability > 4.5]
    plan = min(clear, key=lambda each: len((*each.recorded.fit_hz, *each.recorded.holdout_hz)))
    making = Making(GENERATORS["reality"], discrepancy_for(FISHSIM_MARKERS, load_robot()), catalogue())
    (made,) = film_together([making.make(plan, tmp_path)])
    shipped = answers[plan.name]
    assert made.strengths == pytest.approx(shipped.strengths, rel=5e-3)
    assert made.detectability == pytest.approx(shipped.detectability, abs=0.02)
    assert made.alike == shipped.alike
    assert made.oracle_shrinkage == pytest.approx(shipped.oracle_shrinkage, abs=0.01)


def test_it_is_small_and_its_files_have_the_card_s_checksum() -> None:
    assert sum(path.stat().st_size for path in FOLDER.rglob("*") if path.is_file()) < 10e6
    card = (FOLDER / "CARD.md").read_text()
    assert checksum_of_sessions(SUITE) in card


def test_nothing_in_it_says_what_is_present() -> None:
    """By name; and all tracks are of one length."""
    names = {*catalogue(), *OUTSIDE}
    for path in files():
        said = gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text()
        assert not [name for name in names if name in said or name in path.name]
    assert len({path.stat().st_size for path in files() if path.suffix == ".gz"}) == 1
    assert set(SUITE.names) == set(PLANS)
