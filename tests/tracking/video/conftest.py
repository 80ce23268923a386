from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from tests.tracking.video.clips import CLIPS


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Writes a clip of the catalogue, once."""

    @cache
    def written(name: str) -> Path:
        return CLIPS[name].write(tmp_path_factory.mktemp(name))

    return written
