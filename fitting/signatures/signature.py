"""By how much an effect of some strength moves what a session measured."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.model.session_model import SessionModel
from fitting.signatures.affected_session import AffectedSession, plain_features
from session import CameraSpec
from swimmer.effects import Effect

STRENGTHS = (-3.0, -1.0, 1.0, 3.0)  # standard deviations of a parameter's prior


@dataclass(frozen=True, eq=False)
class Signature:
    """Of one effect on trials whose features stand in one row of length k, and which tell b numbers beside.

    Attributes:
        effect: with the parameters that these trials' markers give it.
        values: (q, p) strengths that were tried.
        features: (q, k) change of the row of features; nan where the twin diverged.
        beside: (q, b) change of what the trials' commands lead to, as filmed and as logged, Hz, and of how decays ring.
    """

    effect: Effect
    values: np.ndarray
    features: np.ndarray
    beside: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """(q, k + b) both, side by side."""
        return np.hstack([self.features, self.beside])


def signature_of(
    effect: Effect,
    model: SessionModel,
    camera: CameraSpec,
    coefficients: np.ndarray,
    values: np.ndarray | None = None,
    sizes: Sequence[float] = STRENGTHS,
) -> Signature:
    """What an effect does to the trials of a session at coefficients (5,), against the plain twin.

    An effect of no strength is the plain twin (see `Effect`): one that is not would have a part that never changes.

    Args:
        effect: of the catalogue or of a user.
        model: the trials beside the plain twin.
        camera: that filmed them.
        coefficients: (5,) at which.
        values: (q, p) strengths; by default each parameter alone, as far as its bounds allow.
        sizes: of each parameter alone, in standard deviations of its prior; by default one and three, either way.
    """
    session = AffectedSession.of([effect], model, camera, coefficients)
    suited = session.effects[0]
    values = strengths(suited, sizes) if values is None else values
    plain = plain_features(model, camera, tuple(map(float, coefficients)))
    rows = (
        session.features(np.tile(coefficients, (len(values), 1)), values) if len(values) else np.zeros((0, len(plain)))
    )
    return Signature(suited, values, rows - plain, session.beside(values))


def strengths(effect: Effect, sizes: Sequence[float] = STRENGTHS) -> np.ndarray:
    """(q, p) each parameter alone, of such sizes in standard deviations as far as its bounds allow."""
    rows = []
    for number, parameter in enumerate(effect.parameters):
        for size in sizes:
            value = float(np.clip(size * parameter.sd, parameter.low, parameter.high))
            if value != 0.0:
                rows.append(value * np.eye(len(effect.parameters))[number])
    return np.unique(rows, axis=0) if rows else np.zeros((0, len(effect.parameters)))
