"""Scale of the picture, common to the swims of a session.

Nose and neck give each swim a scale: in the picture they are as far apart as their boxes sit, and a box sits some
millimetres off its marker. One camera that nobody moved has one scale, so `with_common_scale` gives every swim the mean
over the fitted ones. A swim whose own scale is too far from it for boxes keeps its own, with a flag.

`box_columns` is the other half: by how much an error of each box moves the features of each trial, now that the boxes
of nose and neck of one trial scale the others too.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.pool import CommonScale
from fitting.trial import MeasuredTrial, laid_on_pool
from fitting.trial_model import Sensitivities, TrialModel
from swimcal.flags import Flag

HEAD_BOX_M = 0.002
"""Standard deviation of the boxes of nose and neck from their markers in a trial, m."""
_APART = 4.0  # standard deviations from which boxes alone do not explain that a scale differs


def with_common_scale(trials: Sequence[MeasuredTrial], length_m: float) -> list[MeasuredTrial]:
    """Give swims the mean scale of the fitted ones; one that boxes cannot explain keeps its own and is flagged.

    Args:
        trials: the swims, each with its own scale.
        length_m: distance from nose to neck, m.
    """
    own = {trial.name: np.log(trial.metres_per_px) for trial in sorted(trials, key=lambda trial: trial.name)}
    of_boxes = float(np.sqrt(2) * HEAD_BOX_M / length_m)  # of one scale, relative
    fitted = {trial.name for trial in trials if trial.role == "fit"}
    names = _alike({name: scale for name, scale in own.items() if name in fitted}, of_boxes)
    if not names:  # two scales that disagree, or no swim to fit
        if not fitted:
            return list(trials)
        return [replace(trial, flags=(*trial.flags, _flag(trial, trials))) for trial in trials]
    mean = float(np.mean([own[name] for name in names]))
    common = CommonScale(float(np.exp(mean)), names)
    limit = _APART * of_boxes * np.sqrt(1 + 1 / len(names))
    scaled = []
    for trial in trials:
        if trial.name in names or (trial.role != "fit" and abs(own[trial.name] - mean) < limit):
            scaled.append(replace(at_scale(trial, common.metres_per_px), scale=common))
        else:
            others = [other for other in trials if other.name in names]
            scaled.append(replace(trial, flags=(*trial.flags, _flag(trial, others))))
    return scaled


def at_scale(trial: MeasuredTrial, metres_per_px: float) -> MeasuredTrial:
    """Return a swim at another scale of the picture: its lengths and speeds change in proportion.

    Args:
        trial: the swim.
        metres_per_px: the scale, m/px.
    """
    by, head = metres_per_px / trial.metres_per_px, trial.head
    frames = replace(
        head,
        position_m=by * head.position_m,
        shape_m=by * head.shape_m,
        path_m=by * head.path_m,
        nose_m=by * head.nose_m,
    )
    return replace(
        trial,
        tracks=laid_on_pool(trial.tracks, by * trial.position_m, frames, trial.weight, metres_per_px),
        start_velocity=trial.start_velocity * [by, by, 1.0],
        speed=by * trial.speed,
    )


def _alike(scales: dict[str, float], sd: float) -> tuple[str, ...]:
    """Return whose scales, in logarithms, are alike within the errors of boxes; nobody where two disagree."""
    left = dict(scales)
    while len(left) > 1:
        apart = {name: abs(left[name] - np.mean([left[other] for other in left if other != name])) for name in left}
        worst = max(apart, key=lambda name: (apart[name], name))
        if apart[worst] < _APART * sd * np.sqrt(1 + 1 / (len(left) - 1)):
            break
        if len(left) == 2:
            return ()
        del left[worst]
    return tuple(left)


def _flag(trial: MeasuredTrial, others: Sequence[MeasuredTrial]) -> Flag:
    """Return the flag of a swim whose scale is not that of the others."""
    usual = np.exp(np.mean([np.log(other.metres_per_px) for other in others if other.name != trial.name]))
    longer = 100 * (usual / trial.metres_per_px - 1)
    message = (
        f"nose and neck are {abs(longer):.0f} % {'farther apart' if longer > 0 else 'nearer to each other'} in the "
        "picture than in the other swims: one of their boxes is off, or the camera was moved or set otherwise; it "
        "keeps its own scale, by which its speed goes"
    )
    return Flag("scale_apart", ("nose", "neck"), message=message)


def box_columns(
    models: Sequence[TrialModel],
    sensitivities: Sequence[Sensitivities],
    whose: Sequence[int] | None = None,
    only_head: bool = False,
) -> np.ndarray:
    """Return by how much each box 1 m off its marker moves the stacked features, as columns (K, q), 1/m.

    The columns are those of each trial's boxes in turn. At the end come the scales of swims that are not among the
    models: one column for each, with the error of its scale as if one box alone made it.

    Args:
        models: windows of trials, of k features each, stacked to K.
        sensitivities: their sensitivities.
        whose: number of the trial that each is a window of; default each of its own.
        only_head: whether the columns are those of nose and neck alone.
    """
    numbers = list(range(len(models))) if whose is None else list(whose)
    order = list(dict.fromkeys(numbers))
    first = {number: numbers.index(number) for number in order}
    chosen = models[0].places_of_head if only_head else np.arange(sensitivities[0].boxes.shape[1])
    width, length = len(chosen), len(sensitivities[0].boxes)
    at = {number: slice(width * place, width * (place + 1)) for place, number in enumerate(order)}
    columns = np.zeros((len(models), length, width * len(order)))
    absent: dict[tuple[int, str], np.ndarray] = {}
    for row, (model, each, number) in enumerate(zip(models, sensitivities, numbers, strict=True)):
        columns[row, :, at[number]] += each.boxes[:, chosen]
        scale = model.trial.scale
        if scale is None:
            columns[row, :, at[number]] += np.outer(each.scale, each.spans[chosen])
            continue
        for name in scale.names:
            slope = each.scale[:, 0] / len(scale.names)
            present = [n for n in order if _is(models[first[n]].trial, scale, name)]
            if present:
                columns[row, :, at[present[0]]] += np.outer(slope, sensitivities[first[present[0]]].spans[chosen])
            else:
                column = absent.setdefault((id(scale), name), np.zeros((len(models), length)))
                column[row] += slope * float(np.linalg.norm(each.spans))
    more = [column.reshape(-1, 1) for column in absent.values()]
    return np.hstack([columns.reshape(len(models) * length, -1), *more])


def _is(trial: MeasuredTrial, scale: CommonScale, name: str) -> bool:
    return trial.scale is scale and trial.name == name
