"""One drawn session, its mode and its posterior."""

from __future__ import annotations

import pytest

from benchmarks.posterior.truth import DrawnSession, draw_session
from fitting.mode import Mode
from fitting.posterior.posterior import Posterior, sample_posterior
from fitting.search import find_mode
from fitting.session_model import SessionModel

HELD_OUT_HZ = 1.1


@pytest.fixture(scope="session")
def drawn() -> DrawnSession:
    """Two swims of 5 s, and one that is held out, of a robot that varies between trials; the truth is known."""
    return draw_session(2, held_out_hz=(HELD_OUT_HZ,), step=1 / 16, varied=True)


@pytest.fixture(scope="session")
def mode(drawn: DrawnSession) -> Mode:
    return find_mode(SessionModel.of(drawn.twin, drawn.trials, with_course=True), starts=2)


@pytest.fixture(scope="session")
def posterior(mode: Mode) -> Posterior:
    return sample_posterior(mode, effective=200)
