"""`calib run` on several cores: the posterior is sampled in a process of its own while this one diagnoses."""

import os
import shutil
import time
from pathlib import Path

import pytest

from calib import batch
from calib.batch import run_pipeline
from calib.options import EffortName, Options
from calib.pipeline import Pipeline, open_session
from swimcal.errors import NotEnoughData
from swimcal.session import Session
from tests.calib.children import Sampled, die, fail, linger, refuse
from tests.calib.door import lasting, little_posterior, with_little_effort


def sample_little(session: Session, effort: EffortName | None, workers: int) -> Sampled:
    with pytest.MonkeyPatch.context() as patch:
        with_little_effort(patch)
        little_posterior(patch)
        return batch._sample_alone(session, effort, workers)


def fitted(folder: Path) -> Pipeline:
    """The pipeline of a session, ready to go on with two threads."""
    return Pipeline(open_session(folder), Options("quick", workers=2))


@pytest.mark.long
def test_both_write_what_they_write_one_after_the_other(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    little_posterior(monkeypatch)
    monkeypatch.setattr(batch, "_sample_alone", sample_little)
    other = Path(shutil.copytree(finished, tmp_path / "other" / finished.name))
    run_pipeline(Pipeline(open_session(other), Options("quick", workers=1)))
    pipeline = fitted(finished)
    run_pipeline(pipeline)

    assert {"posterior.nc", "posterior.json", "diagnosis.json"} <= {path.name for path in pipeline.made}
    assert not [path for path in pipeline.made if not path.is_file()]
    binary = {"posterior.nc"}
    one, two = ({k: v for k, v in lasting(folder).items() if k not in binary} for folder in (other, finished))
    assert one == two
    assert pipeline.current_posterior(pipeline.the_fit()) is not None
    assert pipeline.current_diagnosis() is not None


def test_if_its_process_dies_the_posterior_is_sampled_afterwards(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch, "_sample_alone", die)
    monkeypatch.setattr(Pipeline, "diagnosis", lambda _: None)
    monkeypatch.setattr(Pipeline, "posterior", lambda self: self.notes.append("sampled here"))
    pipeline = fitted(finished)
    run_pipeline(pipeline)
    assert pipeline.notes == ["sampled here"]


def test_draws_that_have_not_converged_are_a_note_beside_the_diagnosis(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch, "_sample_alone", refuse)
    monkeypatch.setattr(Pipeline, "diagnosis", lambda _: None)
    pipeline = fitted(finished)
    run_pipeline(pipeline)
    assert pipeline.notes == ["! it has not converged"]
    assert pipeline.current_posterior(pipeline.the_fit()) is None


def test_its_error_is_that_of_the_run(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch, "_sample_alone", fail)
    monkeypatch.setattr(Pipeline, "diagnosis", lambda _: None)
    with pytest.raises(NotEnoughData, match="no swim is left"):
        run_pipeline(fitted(finished))


def test_a_diagnosis_that_is_stopped_leaves_no_process_behind(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = finished / "process"

    def stop(_: Pipeline) -> None:
        while not (told.is_file() and told.read_text()):
            time.sleep(0.05)
        raise KeyboardInterrupt

    monkeypatch.setattr(batch, "_sample_alone", linger)
    monkeypatch.setattr(Pipeline, "diagnosis", stop)
    with pytest.raises(KeyboardInterrupt):
        run_pipeline(fitted(finished))
    with pytest.raises(ProcessLookupError):
        os.kill(int(told.read_text()), 0)
