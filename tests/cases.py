"""Which cases of a parametrized test every run takes, and which wait for the long tests."""

from typing import Any

import pytest


def later(*cases: Any) -> list[pytest.ParameterSet]:
    """Cases, a tuple for one of several parameters, that only `make test-all` takes."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.long) for case in cases]
