"""Random streams: one for each trial and what draws in it, so that changing one trial leaves the others as they are."""

from enum import Enum

import numpy as np


class Stream(Enum):
    """The kinds of random streams; the value is the last entry of their seeds, where it is not 0."""

    SWIM_TRACKER = 0
    DRY_TRACKER = 1
    DECAY_TRACKER = 2
    SWIM_MOTOR = 3
    DRY_MOTOR = 4

    def of(self, seed: int, number: int) -> np.random.Generator:
        """Return the generator of one trial, by its number among those of its kind, from 0."""
        return np.random.default_rng([seed, number, *([self.value] if self.value else [])])
