from __future__ import annotations

import pytest

from diagnosis.pushes import Responses, responses
from tests.diagnosis.linear_models import linear


@pytest.fixture(scope="session")
def pushed() -> Responses:
    """What forces and torques do to the swims of `linear_models`."""
    return responses(linear())
