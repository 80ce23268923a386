"""What the trials ask of the robot itself: its hinges and crank arm, which coefficients can make up for."""

from typing import NamedTuple

import numpy as np

from fitting.posterior.posterior import Posterior
from session import Flag

_ASKED_SD = 2.0  # beyond which a robot that the trials ask for is worth a flag


class RobotPart(NamedTuple):
    """How far a number of the robot may be off what the twin has, as a share of it.

    Attributes:
        quantity: "hinge_stiffness", "hinge_damping" or "crank_arm".
        measured: whether dry experiments gave it.
        sd: what it may be off by before the swim trials are looked at.
        mean_after, sd_after: what it is off by, with the swim trials.
    """

    quantity: str
    measured: bool
    sd: float
    mean_after: float
    sd_after: float


def robot_parts(posterior: Posterior) -> tuple[RobotPart, ...]:
    """Before and after the trials: given coefficients a normal nuisance, here over all draws of these."""
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
    """Of each number of the robot that the trials ask to be far off what it is taken to be."""
    return [
        Flag(
            "robot_off",
            message=f"the trials ask for a {part.quantity.replace('_', ' ')} {100 * part.mean_after:+.0f} % off, more "
            f"than twice the {100 * part.sd:.2g} % to which it is known: measure it; coefficients may be off with it",
        )
        for part in parts
        if abs(part.mean_after) > _ASKED_SD * part.sd
    ]
