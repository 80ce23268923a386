"""The twin with effects, refitted from where their linear forms put it."""

from collections.abc import Sequence

import numpy as np

from diagnosis.evidence import Hypotheses
from diagnosis.linear_model import LinearModel
from diagnosis.refit import Refit, refit
from swimmer.effects import Effect

_HELD = 0.2  # by which strengths are held back: slopes of strong effects are rough


def refitted(linear: LinearModel, hypotheses: Hypotheses, effects: Sequence[Effect], rounds: int) -> Refit:
    """The nearest twin with effects.

    Args:
        linear: the fitted swims beside the nearest plain twin.
        hypotheses: that hold forms of these effects.
        effects: that act, at least one.
        rounds: steps at most.
    """
    names = [each.name for each in hypotheses.effects]
    chosen = [hypotheses.best[names.index(effect.name)] for effect in effects]
    forms = [form for form in chosen if form is not None]
    assert len(forms) == len(effects), "an effect that does nothing explains nothing"
    columns = np.hstack([form.columns for form in forms])
    held = _HELD * np.eye(columns.shape[1])
    target = np.append(linear.space.projected(linear.residual), np.zeros(len(held)))
    strength = np.linalg.lstsq(np.vstack([columns, held]), target, rcond=None)[0]
    ends, start = np.cumsum([len(form.sd) for form in forms])[:-1], []
    for effect, form, own in zip(effects, forms, np.split(strength, ends), strict=True):
        values = np.zeros(len(effect.suited(linear.twin.robot, linear.trials[0].markers).parameters))
        values[list(form.parameters)] = np.clip(own, form.low, form.high) * form.sd
        start.append(values)
    return refit(linear, effects, np.concatenate(start), rounds)
