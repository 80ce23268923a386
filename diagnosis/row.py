"""What is left of a session, in directions in which a gap of no particular cause has no correlation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.constants import LOOSE
from diagnosis.forms import Shown
from fitting.signatures import Whitened

NONE = slice(0, 0)


@dataclass(frozen=True, eq=False)
class Row:
    """A whitened row in directions in which a gap of no particular cause has no correlation.

    Attributes:
        turn: (q, k) from the whitened row.
        left: (q,) what is left.
        spread: (q,) variance of a gap of no particular cause, of mean 1.
    """

    turn: np.ndarray
    left: np.ndarray
    spread: np.ndarray

    @classmethod
    def of(
        cls,
        space: Whitened,
        left: np.ndarray,
        generic: np.ndarray,
        effects: Sequence[Shown] = (),
        frequencies: slice = NONE,
    ) -> "Row":
        """Of what is left (k,).

        A gap of no particular cause has no structure but that of `generic` (k, k); where effects are given, it is like
        any of these (each as likely), but for the share `LOOSE` of its variance, and but for frequencies: only clock
        and drive change these, whatever else is amiss with a fish.
        """
        touched = np.ones((len(generic) + len(space.precision), 1))
        touched[frequencies] = 0.0
        values, vectors = np.linalg.eigh(generic)
        loose = space.freed((vectors * np.sqrt(np.maximum(values, 0.0))).T).T  # (q, k)
        tight = [touched * each.slopes / np.linalg.norm(each.slopes) for each in effects if each.ways]
        share = LOOSE if tight else 1.0
        parts = [np.sqrt(share) * loose / np.linalg.norm(loose)]
        parts += [np.sqrt((1 - share) / len(tight)) * part for part in tight]
        turn, singular, _ = np.linalg.svd(np.hstack(parts), full_matrices=False)
        inside = singular > 1e-9 * singular[0]
        spread = singular[inside] ** 2
        turn = turn[:, inside].T
        return cls(turn, turn @ space.freed(left), spread / spread.mean())

    @property
    def squares(self) -> float:
        """Squared length of what is left; of mean q where there is nothing."""
        return float(self.left @ self.left)
