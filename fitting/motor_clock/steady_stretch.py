"""The longest stretch of a motor's log at steady speed: its drive, where the commands are not known."""

import numpy as np

from swimmer import CrankTurn

STEADY = 0.05  # relative; how far the mean over a turn may be off that of the drive
_STEP_S = 0.02
_FASTEST = 98  # percentile of the speed that counts as the highest


def steady_stretch(turn: CrankTurn) -> tuple[float, float]:
    """First and last instant of it, on the clock of `turn`; the whole log where the crank never turns steadily.

    The speed is taken over whole turns of the crank, so that one that swings within each turn is steady too, and a
    code, which goes to and fro, is not.
    """
    time_s = np.arange(turn.start_s, turn.end_s, _STEP_S)
    period_s = 2 * np.pi / max(float(np.percentile(turn.speed(time_s), _FASTEST)), 1e-9)
    middle_s = time_s[(time_s >= turn.start_s + period_s / 2) & (time_s <= turn.end_s - period_s / 2)]
    if not len(middle_s):
        return turn.start_s, turn.end_s
    speed = (turn.angle(middle_s + period_s / 2) - turn.angle(middle_s - period_s / 2)) / period_s  # (k,)
    drive = np.median(speed[speed > speed.max() / 2]) if speed.max() > 0 else 0.0
    steady = np.abs(speed - drive) <= STEADY * drive
    begins, ends = np.flatnonzero(np.diff(np.pad(steady, 1).astype(int))).reshape(-1, 2).T
    if not len(begins):
        return turn.start_s, turn.end_s
    longest = int(np.argmax(ends - begins))
    return float(middle_s[begins[longest]] - period_s / 2), float(middle_s[ends[longest] - 1] + period_s / 2)
