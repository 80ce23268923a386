import shutil
from pathlib import Path

import pytest

from benchmarks.video.filmed import SessionVideo
from calib.pipeline import Options, Pipeline, open_session
from fitting import left_out
from synthetic import make_session
from tests.calib import filmed as of_video
from tests.calib.door import PLAN, Front, front_door, little_posterior, with_little_effort
from tests.once import made_once


@pytest.fixture(autouse=True)
def little_effort(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A short search, but for tests that ask for the true one."""
    if "true_effort" not in request.fixturenames:
        with_little_effort(monkeypatch, "true_report" in request.fixturenames)


@pytest.fixture
def true_effort() -> None:
    """Asks for the search and the report that users get."""


@pytest.fixture
def true_report() -> None:
    """Asks for the report that users get."""


@pytest.fixture
def calib(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Front:
    return front_door(monkeypatch, capsys)


@pytest.fixture(scope="session")
def fresh_session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "fresh", lambda folder: make_session(folder, PLAN))


@pytest.fixture(scope="session")
def finished_session(fresh_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    def finish(folder: Path) -> None:
        shutil.copytree(fresh_session, folder)
        with pytest.MonkeyPatch.context() as patch:
            with_little_effort(patch)
            pipeline = Pipeline(open_session(folder), Options("quick"))
            pipeline.fit()
            pipeline.report()

    return made_once(tmp_path_factory, "finished", finish)


@pytest.fixture(scope="session")
def sampled_session(finished_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the posterior; one of its effects is called for whatever the data say."""

    def sample(folder: Path) -> None:
        shutil.copytree(finished_session, folder)
        with pytest.MonkeyPatch.context() as patch:
            with_little_effort(patch)
            little_posterior(patch)
            patch.setattr(left_out, "LEFT_OUT_P", 2.0)
            patch.setattr(left_out, "LEFT_OUT_SD", -1.0)
            Pipeline(open_session(folder), Options("quick")).posterior()

    return made_once(tmp_path_factory, "sampled", sample)


@pytest.fixture(scope="session")
def whole_session(sampled_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    def finish(folder: Path) -> None:
        shutil.copytree(sampled_session, folder)
        with pytest.MonkeyPatch.context() as patch:
            with_little_effort(patch)
            pipeline = Pipeline(open_session(folder), Options("quick"))
            pipeline.diagnosis()
            pipeline.report()

    return made_once(tmp_path_factory, "whole", finish)


@pytest.fixture
def whole(whole_session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A session with a fit, its posterior and a diagnosis, all of quick effort."""
    little_posterior(monkeypatch)
    return Path(shutil.copytree(whole_session, tmp_path / "pool"))


@pytest.fixture
def fresh(fresh_session: Path, tmp_path: Path) -> Path:
    """A session without results, of the test's own."""
    return Path(shutil.copytree(fresh_session, tmp_path / "pool"))


@pytest.fixture
def finished(finished_session: Path, tmp_path: Path) -> Path:
    """A session with all its results (quick effort), of the test's own."""
    return Path(shutil.copytree(finished_session, tmp_path / "pool"))


@pytest.fixture(scope="session")
def filmed_session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_once(tmp_path_factory, "filmed", lambda folder: make_session(folder, of_video.PLAN, SessionVideo()))


@pytest.fixture(scope="session")
def tracked_session(filmed_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    def track(folder: Path) -> None:
        pipeline = Pipeline(open_session(shutil.copytree(filmed_session, folder)))
        for spec in pipeline.session.trials:
            pipeline.recordings.videos.tracks(spec)

    return made_once(tmp_path_factory, "tracked", track)


@pytest.fixture(scope="session")
def fitted_session(tracked_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    def fit(folder: Path) -> None:
        shutil.copytree(tracked_session, folder)
        with pytest.MonkeyPatch.context() as patch:
            with_little_effort(patch)
            Pipeline(open_session(folder), Options("quick")).fit()

    return made_once(tmp_path_factory, "fitted", fit)


@pytest.fixture
def filmed(filmed_session: Path, tmp_path: Path) -> Path:
    """A session of videos without results, of the test's own."""
    return Path(shutil.copytree(filmed_session, tmp_path / "pool"))


@pytest.fixture
def tracked(tracked_session: Path, tmp_path: Path) -> Path:
    """A session of videos that were tracked, of the test's own."""
    return Path(shutil.copytree(tracked_session, tmp_path / "pool"))


@pytest.fixture
def fitted(fitted_session: Path, tmp_path: Path) -> Path:
    """A session of videos with a calibration (quick effort), of the test's own."""
    return Path(shutil.copytree(fitted_session, tmp_path / "pool"))
