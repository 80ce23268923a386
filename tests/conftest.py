"""What holds for all tests."""

import gc
import os
import signal
import threading

import pytest
from hypothesis import settings

# Property tests draw the same examples every time, so that a run on a clean clone proves the same as any other.
# HYPOTHESIS_PROFILE=explore draws new ones, to look for what nobody thought of.
# None is held to a time: how long one takes depends on what else the machine does.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))

# A shell's background job ignores Ctrl-C, and so would the programs that the tests start and interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)

SLOWEST = ("notebooks", "calib", "diagnosis", "reports", "datasets", "fitting")
"""Folders whose files take long, the longest first."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The slowest files first: a process that starts one of them last lets the others wait."""
    items.sort(key=_rank)


def pytest_collection_finish() -> None:
    """What is imported by now stays: the garbage collector need not look through it again and again."""
    gc.collect()
    gc.freeze()


def _rank(item: pytest.Item) -> int:
    return next((rank for rank, folder in enumerate(SLOWEST) if folder in item.path.parts), len(SLOWEST))
