"""What the trials say of what they all share beside the coefficients: where markers are glued, and the robot itself.

Given coefficients, these nuisances are normal, for gaits are linear in them. Whoever predicts a swim must take them
together: coefficients that make up for a stiff hinge belong to a robot with a stiff hinge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fitting.posterior.posterior import Posterior
from session import Flag

_ASKED_SD = 2.0  # beyond which a robot that the swims ask for is worth a flag


@dataclass(frozen=True, eq=False)
class SharedNuisances:
    """Given coefficients and the median of the twin's own discrepancies, in standard deviations of their prior.

    Attributes:
        posterior: whose they are.
        gain: (k, q) from what the twin leaves of the measured row to their means.
        covariance: (q, q), whatever the coefficients.
    """

    posterior: Posterior
    gain: np.ndarray
    covariance: np.ndarray

    @classmethod
    def of(cls, posterior: Posterior) -> SharedNuisances:
        """Of the trials that a posterior rests on."""
        found = posterior.found
        columns = found.disturbances.shared(found.off.marker_m)  # (k, q)
        known = found.likelihood.covariance(np.median(posterior.discrepancy, axis=0))
        gain = np.linalg.solve(known, columns)
        return cls(posterior, gain, np.eye(columns.shape[1]) - gain.T @ columns)

    def mean(self, coefficients: np.ndarray) -> np.ndarray:
        """(d, q) given coefficients (d, 5)."""
        return (self.posterior.model.measured - self.posterior.found.likelihood.emulator(coefficients)) @ self.gain

    def drawn(self, coefficients: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """(d, q) one draw for each of the coefficients (d, 5)."""
        values, vectors = np.linalg.eigh(self.covariance)
        root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        return self.mean(coefficients) + random.standard_normal((len(coefficients), len(root))) @ root

    def with_coefficients(self) -> np.ndarray:
        """(5 + q, 5 + q) covariance of coefficients and nuisances."""
        coefficients = self.posterior.coefficients
        total = np.cov(np.hstack([coefficients, self.mean(coefficients)]).T)
        total[5:, 5:] += self.covariance
        return np.asarray(total)


class RobotPart(NamedTuple):
    """How far a number of the robot may be off what the twin has, as a share of it.

    Attributes:
        quantity: "hinge_stiffness", "hinge_damping" or "crank_arm".
        measured: whether dry experiments gave it.
        sd: what it may be off by before the swims are looked at.
        mean_after, sd_after: what it is off by, with the swims.
    """

    quantity: str
    measured: bool
    sd: float
    mean_after: float
    sd_after: float


def robot_parts(posterior: Posterior) -> tuple[RobotPart, ...]:
    """Before and after the swims."""
    shared, doubted = SharedNuisances.of(posterior), posterior.model.trials[0].doubted
    sd = np.sqrt(np.diag(shared.with_coefficients()))[5:]
    mean = shared.mean(posterior.coefficients).mean(axis=0)
    first = len(mean) - len(doubted)
    return tuple(
        RobotPart(doubt.source.quantity, not doubt.source.assumed, doubt.sd, doubt.sd * float(m), doubt.sd * float(s))
        for (doubt, *_), m, s in zip(doubted, mean[first:], sd[first:], strict=True)
    )


def robot_flags(posterior: Posterior) -> list[Flag]:
    """Of each number of the robot that the swims ask to be far off what it is taken to be."""
    return [
        Flag(
            "robot_off",
            message=f"the swims ask for a {part.quantity.replace('_', ' ')} {100 * part.mean_after:+.0f} % off, beyond "
            f"twice the {100 * part.sd:.2g} % to which it is known: measure it, for coefficients may be off with it",
        )
        for part in robot_parts(posterior)
        if abs(part.mean_after) > _ASKED_SD * part.sd
    ]
