from __future__ import annotations

import pytest

from diagnosis.places import ForceResponses, responses
from tests.diagnosis.linear_models import linear


@pytest.fixture(scope="session")
def pushed() -> ForceResponses:
    """What forces and torques do to the swims of `linear_models`."""
    return responses(linear())
