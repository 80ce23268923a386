"""What to measure next: experiments that would separate what is still confused, by how much and how surely."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.stats import norm

from diagnosis.ground import Ground
from diagnosis.probabilities import Probabilities
from diagnosis.refit import Refit
from diagnosis.verdict import Verdict
from swimmer.effects import Effect


@dataclass(frozen=True)
class Experiment:
    """One that could be made.

    Attributes:
        describe: what to do, in a sentence.
        separates: two names, or a name and "no_gap".
        expected_error: chance to still take one for the other afterwards.
    """

    describe: str
    separates: tuple[str, str]
    expected_error: float


def next_experiments(
    ground: Ground,
    probabilities: Probabilities,
    verdict: Verdict,
    effects: Mapping[str, Effect],
    best: Refit | None,
) -> tuple[Experiment, ...]:
    """For every two effects that are still confused."""
    return ()
