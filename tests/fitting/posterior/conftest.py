"""One drawn session and its posterior, for all long tests."""

from __future__ import annotations

import pytest

from benchmarks.posterior.truth import DrawnSession, draw_session
from fitting.posterior import Posterior, sample_posterior

HELD_OUT_HZ = 1.1


@pytest.fixture(scope="session")
def drawn() -> DrawnSession:
    """Two swims of 5 s, and one that is held out; the truth is known."""
    return draw_session(2, held_out_hz=(HELD_OUT_HZ,))


@pytest.fixture(scope="session")
def posterior(drawn: DrawnSession) -> Posterior:
    return sample_posterior(drawn.trials, drawn.twin, effective=400, seed=0)
