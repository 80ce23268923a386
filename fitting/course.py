"""Whether a swim goes straight: forward, sideways and turning.

A symmetric twin in still water swims straight; what a robot does beside that, the marker distance counts against the
twin although no coefficient can mend it.
"""

from typing import NamedTuple

import numpy as np

from fitting.series import design, weighted_fit
from fitting.speed import slope_error
from fitting.trial import MeasuredTrial
from tracking import HeadFrame

_FEWEST = 12  # frames


class Rate(NamedTuple):
    """A slope and its standard error (nan for a simulation)."""

    value: float
    se: float


class Course(NamedTuple):
    """How a swim goes on, in the head's own axes.

    Attributes:
        forward: speed along the head's axis, m/s.
        sideways: speed across it, to the left of the way it swims, m/s.
        turning: rate of the heading, counter-clockwise from above, rad/s.
    """

    forward: Rate
    sideways: Rate
    turning: Rate


def course_of(trial: MeasuredTrial, head: HeadFrame | None = None) -> Course:
    """The course after warm-up of a trial, or of a simulation of it: a line beside two harmonics of the beat.

    All nan where fewer than twelve frames are known. Nothing is forecast by it, so a held-out trial's first beats count
    too: sideways the beat is as large as the drift, and a single beat tells the one badly from the other.

    Args:
        trial: as measured.
        head: of a simulation (n, m, 2); default: the measured one, with standard errors.
    """
    swum = head or trial.head
    series = np.column_stack([swum.forward_m, -swum.path_m[:, 1], swum.heading_rad])
    after = (trial.time_s >= trial.warmup_s - 1e-9) & np.isfinite(series).all(axis=1)
    if after.sum() < _FEWEST:
        return Course(*[Rate(float("nan"), float("nan"))] * 3)
    time_s, series, hz = trial.time_s[after], series[after], trial.frequency.hz
    columns, weight = design(time_s, hz, harmonics=2), np.ones_like(series)
    found, span = weighted_fit(columns, series, weight), float(np.ptp(time_s))
    errors = [float("nan")] * 3 if head else [slope_error(time_s, each, hz) for each in series.T]
    return Course(*(Rate(*each) for each in zip(map(float, found[1] / span), errors, strict=True)))
