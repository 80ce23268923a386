"""How many threads simulations take."""

import os

VARIABLE = "SWIMCAL_WORKERS"


def workers_of(wanted: int) -> int:
    """As many as wanted; for 0 as the environment variable ``SWIMCAL_WORKERS`` says, and without it 0: all cores.

    Processes side by side with a thread each do more than processes with threads on all cores each.

    Raises:
        ValueError: the variable is no number.
    """
    setting = os.environ.get(VARIABLE, "0")
    if not setting.isdecimal():
        raise ValueError(f"{VARIABLE}: found {setting!r}, expected a number of threads, or 0 for all cores")
    return wanted or int(setting)
