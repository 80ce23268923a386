"""Work for processes of their own, which start quickly because this module loads next to nothing."""

import os
import time
from pathlib import Path
from typing import Any

from swimcal.errors import NotEnoughData, SwimcalError

Sampled = tuple[list[Path], list[str], SwimcalError | None]


def fatal(number: int) -> int:
    """One piece ends its process."""
    if number == 1:
        os._exit(1)
    return 2 * number


def die(_session: object, effort: object, workers: int) -> Sampled:  # noqa: ARG001
    """The process ends before there is a posterior."""
    os._exit(1)


def linger(session: Any, effort: object, workers: int) -> Sampled:  # noqa: ARG001
    """It tells who it is, and takes a minute."""
    (session.folder / "process").write_text(str(os.getpid()))
    time.sleep(60)
    return [], [], None


def refuse(_session: object, effort: object, workers: int) -> Sampled:  # noqa: ARG001
    """The draws do not converge."""
    return [], ["! it has not converged"], None


def fail(_session: object, effort: object, workers: int) -> Sampled:  # noqa: ARG001
    """There is nothing to sample from."""
    return [], [], NotEnoughData("no swim is left")
