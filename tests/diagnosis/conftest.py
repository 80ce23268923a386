from __future__ import annotations

import pytest

from diagnosis.pushes import Responses, responses
from tests.diagnosis.grounds import ground


@pytest.fixture(scope="session")
def pushed() -> Responses:
    """What forces and torques do to the swims of `grounds`."""
    return responses(ground())
