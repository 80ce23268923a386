import shutil
from pathlib import Path

import pytest

from benchmarks.video.filmed import SessionVideo
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from swimsynth.session import make_session
from tests.calib import filmed as of_video
from tests.calib.door import PLAN, Front, front_door, little_posterior, with_little_effort
from tests.once import copied, made_once


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


def work_off(session: Path, folder: Path, *stages: str) -> None:
    """A copy of a session in which stages of the pipeline are done, with little effort."""
    pipeline = Pipeline(open_session(shutil.copytree(session, folder)), Options("quick"))
    with pytest.MonkeyPatch.context() as patch:
        with_little_effort(patch)
        little_posterior(patch)
        for stage in stages:
            getattr(pipeline, stage)()


@pytest.fixture
def calib(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Front:
    return front_door(monkeypatch, capsys)


@pytest.fixture(scope="session")
def fresh_session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Without results."""
    return made_once(tmp_path_factory, "fresh", lambda folder: make_session(folder, PLAN))


@pytest.fixture(scope="session")
def finished_session(fresh_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With all that `calib run --effort quick` makes."""
    return made_once(tmp_path_factory, "finished", lambda folder: work_off(fresh_session, folder, "fit", "report"))


@pytest.fixture(scope="session")
def sampled_session(finished_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the posterior."""
    return made_once(tmp_path_factory, "sampled", lambda folder: work_off(finished_session, folder, "posterior"))


@pytest.fixture(scope="session")
def whole_session(sampled_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With a fit, its posterior and a diagnosis, all of quick effort."""
    return made_once(tmp_path_factory, "whole", lambda folder: work_off(sampled_session, folder, "diagnosis", "report"))


@pytest.fixture(scope="session")
def filmed_session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of videos, without results."""
    return made_once(tmp_path_factory, "filmed", lambda folder: make_session(folder, of_video.PLAN, SessionVideo()))


@pytest.fixture(scope="session")
def tracked_session(filmed_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of videos that were tracked."""

    def track(folder: Path) -> None:
        pipeline = Pipeline(open_session(shutil.copytree(filmed_session, folder)))
        for spec in pipeline.session.trials:
            pipeline.recordings.videos.tracks(spec)

    return made_once(tmp_path_factory, "tracked", track)


@pytest.fixture(scope="session")
def fitted_session(tracked_session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of videos, with a calibration."""
    return made_once(tmp_path_factory, "fitted", lambda folder: work_off(tracked_session, folder, "fit"))


fresh, finished, sampled = copied("fresh_session"), copied("finished_session"), copied("sampled_session")
filmed, tracked, fitted = copied("filmed_session"), copied("tracked_session"), copied("fitted_session")


@pytest.fixture
def whole(whole_session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One of the test's own, whose posterior is made again as quickly."""
    little_posterior(monkeypatch)
    return Path(shutil.copytree(whole_session, tmp_path / "pool"))
