"""What holds for all tests."""

import gc
import os
import re
import signal
import threading
from typing import Any

import pytest
from hypothesis import settings

# Property tests draw the same examples every time, so that a run on a clean clone proves the same as any other; those
# of `make test-all` (HYPOTHESIS_PROFILE=many) are more of them.
# HYPOTHESIS_PROFILE=explore draws new ones, to look for what nobody thought of.
# None is held to a time: how long one takes depends on what else the machine does.
settings.register_profile("same", derandomize=True, deadline=None, max_examples=25)
settings.register_profile("many", derandomize=True, deadline=None, max_examples=150)
settings.register_profile("explore", derandomize=False, deadline=None, max_examples=150)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))

# A shell's background job ignores Ctrl-C, and so would the programs that the tests start and interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)

SLOWEST = ("notebooks", "calib", "diagnosis", "reports", "datasets", "fitting")
"""Folders whose files take long, the longest first."""
TOGETHER = re.compile(r"tests/(diagnosis|fitting/\w+|tracking/lens|tracking/video)/")
"""Folders whose files all use what takes long to make."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The slowest files first: a process that starts one of them last lets the others wait."""
    items.sort(key=_rank)


def pytest_collection_finish() -> None:
    """What is imported by now stays: the garbage collector need not look through it again and again."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Whole files to a process, or whole folders, whose fixtures would else be made by each of them."""
    from xdist.scheduler import LoadFileScheduling

    class LoadFolderScheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            together = TOGETHER.match(nodeid)
            return together[0] if together else super()._split_scope(nodeid)

    return LoadFolderScheduling(config, log) if config.getvalue("dist") == "loadfile" else None


def _rank(item: pytest.Item) -> int:
    return next((rank for rank, folder in enumerate(SLOWEST) if folder in item.path.parts), len(SLOWEST))
