"""The engine's own log, kept quiet where we look for divergence ourselves and report it in our own words."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco


@contextmanager
def quiet_engine() -> Iterator[None]:
    """While it lasts the engine neither prints warnings nor writes MUJOCO_LOG.TXT into the user's folder."""
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_console = quiet.logto_file = False
    quiet.set()
    try:
        yield
    finally:
        before.set()
