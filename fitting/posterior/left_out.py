"""What the twin leaves out, effect by effect: whether the trials ask for it, and what it would do to coefficients.

A misfit in no particular direction is judged by all numbers at once, among which one effect may hide that moves
coefficients by much. So each effect is asked by itself as well (score test; Rao 1948).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fitting.coefficient_fit import NAMES
from session import Flag

SEEN = 3.3  # standard deviations from which what is there is taken for nothing in one case of twenty
LEFT_OUT_P = 0.01  # of any effect as likely by chance, below which the likeliest is worth a flag
_AS_LIKELY = 2.0  # difference of squares, twice that of ln likelihoods, within which another is named as well
_MOST = 3  # names


class LeftOut(NamedTuple):
    """One parameter of an effect that the twin leaves out.

    Attributes:
        effect, parameter, unit: which.
        alone: whether the effect has no other parameter.
        prior_sd: how large it is on robots as they are built, in that unit.
        value: that the trials ask for, in that unit, all else as the posterior has it.
        z: of that, in its own standard deviations.
        chance: probability that noise alone would ask for any of all that were tried by as much (Bonferroni).
        shows: by how many standard deviations of all that disturbs the trials `prior_sd` would move them,
            coefficients refitted.
        moves: (5,) by how many of their standard deviations coefficients are too high if it is `prior_sd` large.
    """

    effect: str
    parameter: str
    alone: bool
    unit: str
    prior_sd: float
    value: float
    z: float
    chance: float
    shows: float
    moves: np.ndarray

    @property
    def name(self) -> str:
        """Of the effect, and of its parameter where it has one of several."""
        return self.effect if self.alone else f"{self.effect}: {self.parameter}"

    @property
    def asked(self) -> bool:
        """Whether the trials ask for it by more than chance."""
        return self.chance < LEFT_OUT_P

    @property
    def hides(self) -> bool:
        """Whether it may be there unseen and move a coefficient by more than a standard deviation."""
        return self.shows < SEEN and float(np.abs(self.moves).max()) > 1


def left_out_flags(tried: Sequence[LeftOut]) -> list[Flag]:
    """That the trials ask for an effect which the twin leaves out.

    Args:
        tried: the likeliest first.
    """
    if not tried or not tried[0].asked:
        return []
    best = tried[0]
    alike = dict.fromkeys(each.effect for each in tried if best.z**2 - each.z**2 < _AS_LIKELY)
    names = " or ".join(name.replace("_", " ") for name in list(alike)[:_MOST])
    moves = best.moves * best.value / best.prior_sd
    most = int(np.argmax(np.abs(moves)))
    of = f"{best.effect.replace('_', ' ')} of {best.value:.2g}" + (f" {best.unit}" if best.unit != "1" else "")
    message = (
        f"the swims ask for what the twin leaves out: {names} ({best.z:.1f} standard deviations, p {best.chance:.1g} "
        f"for any of {len(tried)} that were tried). With {of} "
        f"{NAMES[most].replace('_', ' ')} would be {abs(moves[most]):.1f} of its standard deviations "
        f"{'lower' if moves[most] > 0 else 'higher'}; calib diagnose weighs all effects together"
    )
    return [Flag("effect_left_out", message=message)]
