"""Tendons that hang loose before they pull or push."""

from dataclasses import dataclass

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength

_TYPICAL_M, _MOST_M = 0.002, 0.012
_KNEE = 0.15  # of the slack: over how much of its length a line comes tight


@dataclass(frozen=True)
class TendonSlack(Mechanism):
    """Line and rod ends have play: a tendon pulls when stretched by more than its slack, and pushes beyond its play.

    The tendons of the base state push more than they pull, so both ends of the play matter. Each end comes tight over a
    smooth knee of width w: T = k (soft(s - slack) - soft(-s - play)), soft(u) = w log(1 + exp(u / w)), and the damper
    with the slope of it.

    Attributes:
        pull_left_m, pull_right_m: slack.
        push_m: play.
    """

    pull_left_m: float
    pull_right_m: float
    push_m: float

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """What the tension is more than that of tight tendons."""
        pull_m = np.concatenate(np.broadcast_arrays(self.pull_left_m, self.pull_right_m), axis=1)
        width = _KNEE * (pull_m + self.push_m) / 2
        stretch, p = now.pull.stretch_m, now.parameters
        tight, loose = (stretch - pull_m) / width, (-stretch - self.push_m) / width
        held = width * (np.logaddexp(0, tight) - np.logaddexp(0, loose))
        slope = 0.5 * (1 + np.tanh(tight / 2)) + 0.5 * (1 + np.tanh(loose / 2))
        tension = p.tendon_stiffness_n_m * held + p.tendon_damping_n_s_m * slope * now.pull.rate_m_s
        return now.tighten(tension - now.pull.tension_n)


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how differently long the two lines are, and how much play there is to the slack. Saturates at 12 mm."""
    uneven, play = random.uniform(-0.05, 0.05), random.uniform(0.9, 1.1)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        slack_m = _MOST_M * np.tanh(_TYPICAL_M / _MOST_M * strength)
        return (TendonSlack(float(slack_m * (1 + uneven)), float(slack_m * (1 - uneven)), float(slack_m * play)),)

    return at
