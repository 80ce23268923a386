"""The number of threads that simulations take."""

import os

VARIABLE = "SWIMCAL_WORKERS"


def workers_of(wanted: int) -> int:
    """Return the number of threads: `wanted`, or if that is 0 the value of ``SWIMCAL_WORKERS``; 0 means all cores.

    Several processes with a thread each do more than several processes with threads on all cores each.

    Raises:
        ValueError: the variable is no number.
    """
    setting = os.environ.get(VARIABLE, "0")
    if not setting.isdecimal():
        raise ValueError(f"{VARIABLE}: found {setting!r}, expected a number of threads, or 0 for all cores")
    return wanted or int(setting)
