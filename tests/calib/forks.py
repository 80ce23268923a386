"""Processes that begin with all that `calib` imports, which would else take each of them some seconds."""

from functools import cache
from multiprocessing import forkserver, get_context
from multiprocessing.context import ForkServerContext


@cache
def forks() -> ForkServerContext:
    """What starts them, in place of the context "spawn"."""
    context = get_context("forkserver")
    context.set_forkserver_preload(["distributed", "calib.cli", "calib.batch", "tests.calib.door"])
    forkserver.ensure_running()
    return context
