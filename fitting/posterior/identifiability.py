"""Identifiability of the coefficients (posterior covariance against the prior's), and of the robot."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fitting.coefficient_fit import NAMES
from fitting.posterior.posterior import Posterior
from session import Flag
from swimmer.fluid import COEFFICIENT_BOUNDS

_WORTH_NAMING = 0.25  # least part of a direction that is named
_ASKED_SD = 2.0  # error of the robot, in standard deviations, that is worth a flag


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What the trials determine of the coefficients and of their combinations.

    Attributes:
        determined: (5,) whether each coefficient is determined; none is that presses against a bound.
        at_bound: (5,) whether its posterior would be narrow enough but is at a bound of the prior.
        narrowed: (5,) standard deviation over that of the prior.
        correlation: (5, 5).
        directions: (5, 5) unit vectors of combinations, the best determined first; the prior is the same in all.
        direction_narrowed: (5,) standard deviation along each over that of the prior.
    """

    determined: np.ndarray
    at_bound: np.ndarray
    narrowed: np.ndarray
    correlation: np.ndarray
    directions: np.ndarray
    direction_narrowed: np.ndarray

    @property
    def sentence(self) -> str:
        """Sentences on what is determined, what is not, and what only the prior's bound limits."""
        pressed = self._name(self.at_bound)
        against = [f"{_verb(pressed, 'presses', 'press')} against a bound of the prior."] if pressed else []
        sentences = [self._sentence_on_determined, *against]
        return " ".join(sentence[0].upper() + sentence[1:] for sentence in sentences)

    @property
    def _sentence_on_determined(self) -> str:
        held, loose = self._name(self.determined), self._name(~self.determined & ~self.at_bound)
        if len(held) == len(NAMES):
            return "All five coefficients are determined by these trials."
        if not held:
            return "None of the five coefficients is determined by these trials."
        if not loose:
            return f"{_verb(held, 'is', 'are')} determined by these trials."
        return f"{_verb(loose, 'is', 'are')} not determined by these trials; {_verb(held, 'is', 'are')}."

    def _name(self, chosen: np.ndarray) -> list[str]:
        return [name.replace("_", " ") for name, yes in zip(NAMES, chosen, strict=True) if yes]

    def combination(self, row: int) -> str:
        """Return a direction in words, its large parts first: `0.9 magnus lift − 0.4 kutta lift`."""
        parts = self.directions[row]
        named = [i for i in np.argsort(-np.abs(parts)) if abs(parts[i]) >= _WORTH_NAMING]
        first = np.sign(parts[named[0]])
        words = [f"{abs(parts[i]):.2g} {NAMES[i].replace('_', ' ')}" for i in named]
        signs = ["+" if parts[i] * first > 0 else "−" for i in named]
        return " ".join([words[0], *(f"{sign} {word}" for sign, word in zip(signs[1:], words[1:], strict=True))])


def identifiability(posterior: Posterior) -> Identifiability:
    """Compute what the draws of a posterior determine."""
    low, high = COEFFICIENT_BOUNDS
    prior = (high - low) ** 2 / 12  # variance of the uniform prior, the same for all
    covariance = np.cov(posterior.coefficients.T)
    spread = np.sqrt(np.diag(covariance))
    shares, directions = np.linalg.eigh(covariance / prior)
    return Identifiability(
        determined=np.array([marginal.determined for marginal in posterior.marginals.values()]),
        at_bound=np.array([m.narrow and bool(m.at_bounds) for m in posterior.marginals.values()]),
        narrowed=spread / np.sqrt(prior),
        correlation=covariance / np.outer(spread, spread),
        directions=directions.T,
        direction_narrowed=np.sqrt(np.maximum(shares, 0.0)),
    )


def _verb(names: list[str], one: str, several: str) -> str:
    listed = " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else names[0]
    return f"{listed} {one if len(names) == 1 else several}"


class RobotPart(NamedTuple):
    """Relative error that a number of the twin may have against the robot.

    Attributes:
        quantity: "hinge_stiffness", "hinge_damping" or "crank_arm".
        measured: whether dry experiments gave it.
        sd: standard deviation of its error before the swim trials are looked at.
        mean_after, sd_after: mean and standard deviation of its error with the swim trials.
    """

    quantity: str
    measured: bool
    sd: float
    mean_after: float
    sd_after: float


def robot_parts(posterior: Posterior) -> tuple[RobotPart, ...]:
    """Return the robot's uncertain numbers before and after the trials.

    Given coefficients they are a normal nuisance, here averaged over all draws of these.
    """
    mode = posterior.mode
    columns = np.vstack([block.sensitivities.robot for block in mode.blocks])  # (k, q)
    gain = np.linalg.solve(mode.total, columns)
    means = (mode.model.measured - posterior.surrogate.likelihood.emulator(posterior.coefficients)) @ gain  # (d, q)
    variance = 1 - (gain * columns).sum(axis=0) + means.var(axis=0)
    doubts = [each.doubt for each in mode.model.trials[0].doubted]
    return tuple(
        RobotPart(doubt.source.quantity, not doubt.source.assumed, doubt.sd, doubt.sd * float(m), doubt.sd * float(s))
        for doubt, m, s in zip(doubts, means.mean(axis=0), np.sqrt(variance), strict=True)
    )


def robot_flags(parts: tuple[RobotPart, ...]) -> list[Flag]:
    """Flag each number of the robot that the trials ask to be far from what it is taken to be."""
    return [
        Flag(
            "robot_off",
            message=f"the trials ask for a {part.quantity.replace('_', ' ')} {100 * part.mean_after:+.0f} % off, more "
            f"than twice the {100 * part.sd:.2g} % to which it is known: measure it; coefficients may be off with it",
        )
        for part in parts
        if abs(part.mean_after) > _ASKED_SD * part.sd
    ]
