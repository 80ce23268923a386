"""By how much an effect of some strength moves what a session measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fitting.posterior.session_model import SessionModel
from fitting.signatures.affected_trial import AffectedTrial
from fitting.signatures.view_of import picture_px, view_of
from session import CameraSpec
from swimmer.effects import AffectedTwin, Effect, View

STRENGTHS = (-3.0, -1.0, 1.0, 3.0)  # standard deviations of a parameter's prior


@dataclass(frozen=True, eq=False)
class Signature:
    """Of one effect on t trials, whose gaits stand in one row of length k.

    Attributes:
        effect: with the parameters that these trials' markers give it.
        values: (q, p) strengths that were tried.
        gaits: (q, k) change of the row of gaits; nan where the twin diverged.
        hertz: (q, t) change of the frequency that each trial's command leads to; 0 where nobody knows the command.
    """

    effect: Effect
    values: np.ndarray
    gaits: np.ndarray
    hertz: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """(q, k + t) both, side by side."""
        return np.hstack([self.gaits, self.hertz])


def signature_of(
    effect: Effect,
    model: SessionModel,
    camera: CameraSpec,
    coefficients: np.ndarray,
    values: np.ndarray | None = None,
    sizes: Sequence[float] = STRENGTHS,
) -> Signature:
    """What an effect does to the trials of a session at coefficients (5,).

    Args:
        effect: of the catalogue or of a user.
        model: the trials beside the plain twin.
        camera: that filmed them.
        coefficients: (5,) at which.
        values: (q, p) strengths; by default each parameter alone, as far as its bounds allow.
        sizes: of each parameter alone, in standard deviations of its prior; by default one and three, either way.
    """
    trials = affected_trials([effect], model, camera, coefficients)
    suited = trials[0].twin.effects[0]
    values = strengths(suited, sizes) if values is None else values
    tried = np.vstack([np.zeros((1, values.shape[1])), values])
    rows = np.hstack([trial.gaits(np.tile(coefficients, (len(tried), 1)), tried) for trial in trials])
    return Signature(suited, values, rows[1:] - rows[0], _hertz(tried, trials))


def affected_trials(
    effects: Sequence[Effect], model: SessionModel, camera: CameraSpec, coefficients: np.ndarray
) -> tuple[AffectedTrial, ...]:
    """The trials of a session beside twins with effects, seen as the plain twins of coefficients (5,) say."""
    twins = {id(each.twin): AffectedTwin(each.twin, effects) for each in model.trials}
    views = views_of(model, camera, tuple(map(float, coefficients)))
    return tuple(
        AffectedTrial(each, twins[id(each.twin)], view) for each, view in zip(model.trials, views, strict=True)
    )


@lru_cache(maxsize=8)
def views_of(model: SessionModel, camera: CameraSpec, coefficients: tuple[float, ...]) -> tuple[View, ...]:
    """The view of each trial of a session, one picture for all."""
    size, at = picture_px([each.trial for each in model.trials], camera), np.array([coefficients])
    return tuple(view_of(each.trial, each.positions(at)[0], camera, size) for each in model.trials)


def strengths(effect: Effect, sizes: Sequence[float] = STRENGTHS) -> np.ndarray:
    """(q, p) each parameter alone, of such sizes in standard deviations as far as its bounds allow."""
    rows = []
    for number, parameter in enumerate(effect.parameters):
        for size in sizes:
            value = float(np.clip(size * parameter.sd, parameter.low, parameter.high))
            if value != 0.0:
                rows.append(value * np.eye(len(effect.parameters))[number])
    return np.unique(rows, axis=0) if rows else np.zeros((0, len(effect.parameters)))


def _hertz(values: np.ndarray, trials: Sequence[AffectedTrial]) -> np.ndarray:
    """(q, t) change of frequencies from the first of values (1 + q, p)."""
    told = np.column_stack([each.hertz(values) for each in trials])
    return np.nan_to_num(told[1:] - told[0])
