"""Scale of the picture, common to the swims of a session.

Nose and neck give each swim a scale: in the picture they are as far apart as their boxes sit, and a box sits some
millimetres off its marker. One camera that nobody moved has one scale, so `with_common_scale` gives every swim the mean
over the fitted ones. A swim whose own scale is too far from the others' for boxes keeps its own, with a flag; so does
one whose body is longer or shorter in the picture, nose to tail, where boxes matter less.

Two functions tell what errors do to features: `box_columns` those of each box, now that the boxes of nose and neck of
one trial scale the others too, and `head_marker_columns` those of where nose and neck sit on the body.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.pool import CommonScale
from fitting.trial import MeasuredTrial, laid_on_pool
from fitting.trial_model import Sensitivities, TrialModel
from swimcal.flags import Flag
from swimcal.session_file import HEAD_MARKERS

HEAD_MARKER_M = 0.0015
"""Standard deviation of nose and neck from their places on the body, where a ruler lays them out, m."""
HEAD_BOX_M = 0.002
"""Standard deviation of the boxes of nose and neck from their markers in a trial, m."""
_APART = 3.5  # standard deviations from which boxes alone do not explain that a scale differs
_LONGER = 0.05  # relative difference of the body's length in the picture; public trials reach 0.048, simulated 0.02
_FEWEST = 3  # least number of swims: of two nobody knows which body is the odd one
_FEWEST_MARKERS = 4  # least number of markers of a body's length


def with_common_scale(trials: Sequence[MeasuredTrial], length_m: float) -> list[MeasuredTrial]:
    """Give swims one scale; one that boxes cannot explain keeps its own and is flagged.

    The scale is the mean over the fitted swims that are alike; over all that are, where none of these is fitted.

    Args:
        trials: the swims, each with its own scale.
        length_m: distance from nose to neck, m.
    """
    own = {trial.name: float(np.log(trial.metres_per_px)) for trial in sorted(trials, key=lambda trial: trial.name)}
    middle = float(np.median(list(own.values()))) if own else 0.0
    limit = _APART * of_boxes(length_m) * np.sqrt(1 - 1 / max(len(own), 2))
    longer = _longer_bodies(trials)
    alike = tuple(name for name, scale in own.items() if abs(scale - middle) < limit and name not in longer)
    fitted = {trial.name for trial in trials if trial.role == "fit"}
    names = tuple(name for name in alike if name in fitted) or alike
    common = CommonScale(float(np.exp(np.mean([own[name] for name in names]))), names) if names else None
    return [
        replace(at_scale(trial, common.metres_per_px), scale=common)
        if common is not None and trial.name in alike
        else replace(trial, flags=(*trial.flags, _flag(own, trial.name, longer.get(trial.name))))
        for trial in trials
    ]


def of_boxes(length_m: float) -> float:
    """Return the relative standard deviation of a scale by the boxes of one trial, nose to neck being this long."""
    return float(np.sqrt(2) * HEAD_BOX_M / length_m)


def scale_sd(trial: MeasuredTrial, length_m: float) -> float:
    """Return the relative standard deviation of a swim's scale, by boxes and by the markers' places on the body.

    Where session and robot disagree on the distance from nose to neck, either may be right.

    Args:
        trial: the swim.
        length_m: distance from nose to neck of the robot, m.
    """
    count = 1 if trial.scale is None else len(trial.scale.names)
    places_m = np.hypot(np.sqrt(2) * HEAD_MARKER_M, _farther_apart_m(trial, length_m))
    return float(np.hypot(of_boxes(length_m) / np.sqrt(count), places_m / length_m))


def _farther_apart_m(trial: MeasuredTrial, length_m: float) -> float:
    """Return by how much nose and neck of a swim are farther apart by the session than by the robot, m."""
    return 0.0 if trial.scale_length_m is None else trial.scale_length_m - length_m


def head_marker_columns(model: TrialModel, sensitivities: Sensitivities) -> np.ndarray:
    """Return the effect (k, 6) on features of where nose and neck sit on the body, by standard deviations.

    A ruler lays them out, and a shift of either scales the picture: columns of the nose's x and y and the neck's. Where
    the session has them at another distance than the robot, the session gives the scale, and nose or neck sits that far
    off along the body, the picture's scale being the same: a column of each, 0 where the two agree.

    Args:
        model: a window of a trial, of k features.
        sensitivities: its sensitivities.
    """
    robot, markers = model.twin.robot, sensitivities.markers[:, model.places_of_head]  # (k, 4): x and y of each
    nose_m, neck_m = robot.marker_positions_m(HEAD_MARKERS)[:, :2]
    along = (neck_m - nose_m) / np.linalg.norm(neck_m - nose_m)
    apart_m = _farther_apart_m(model.trial, robot.scale_length_m)
    longer = sensitivities.scale / robot.scale_length_m
    unscaled = np.column_stack([markers[:, :2] @ along, markers[:, 2:] @ along]) + longer * [-1.0, 1.0]
    return np.hstack([HEAD_MARKER_M * markers, apart_m / np.sqrt(2) * unscaled])


def _longer_bodies(trials: Sequence[MeasuredTrial]) -> dict[str, float]:
    """Return by how much a body is longer in the picture than in the other swims, of swims in which it is, by name.

    The length is that of the line through the markers that all swims show, which bends with the body. It must be
    another one also without its last marker, whose box may be off.
    """
    shown = np.all([trial.weight[trial.kept].any(axis=0) for trial in trials], axis=0) if trials else np.zeros(0, bool)
    if len(trials) < _FEWEST or shown.sum() < _FEWEST_MARKERS:
        return {}
    lengths = np.log([_body_lengths(trial, shown) for trial in trials])  # (t, 2)
    found = {}
    for place, trial in enumerate(trials):
        apart = lengths[place] - np.median(np.delete(lengths, place, axis=0), axis=0)
        if np.all(apart > _LONGER) or np.all(apart < -_LONGER):
            found[trial.name] = float(np.expm1(apart[0]))
    return found


def _body_lengths(trial: MeasuredTrial, shown: np.ndarray) -> tuple[float, float]:
    """Return the length of a body in the picture through the markers shown (m,), and without the last of them, px."""
    seen = (trial.weight > 0) & trial.kept[:, None]
    place_px = np.where(seen[..., None], trial.position_m, np.nan)[:, shown] / trial.metres_per_px
    apart_px = np.linalg.norm(np.diff(place_px, axis=1), axis=2)  # (n, s)
    lengths_px = [
        float(np.median(each[np.isfinite(each)])) if np.isfinite(each).any() else np.nan for each in apart_px.T
    ]
    return float(np.sum(lengths_px)), float(np.sum(lengths_px[:-1]))


def _flag(scales: dict[str, float], name: str, longer: float | None) -> Flag:
    """Flag a swim whose scale is apart from the others', all in logarithms of m/px, or whose body is longer."""
    apart = scales[name] - float(np.median([scale for other, scale in scales.items() if other != name]))
    if longer is not None:
        message = (
            f"its body is {100 * abs(longer):.0f} % {'longer' if longer > 0 else 'shorter'} in the picture than in the "
            "other swims: was the camera moved, or set otherwise? It keeps its own scale, by which its speed goes"
        )
        return Flag("scale_apart", message=message)
    message = (
        f"nose and neck are {100 * abs(np.exp(-apart) - 1):.0f} % "
        f"{'nearer to each other' if apart > 0 else 'farther apart'} in the picture than in the other swims: one of "
        "their boxes is off, or the camera was moved or set otherwise; it keeps its own scale, by which its speed goes"
    )
    return Flag("scale_apart", message=message)


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
        tracks=laid_on_pool(trial.tracks, by * trial.position_m, frames, trial.own_weight, metres_per_px),
        start_velocity=trial.start_velocity * [by, by, 1.0],
        speed=by * trial.speed,
    )


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
    chosen = models[0].places_of_head if only_head else np.arange(sensitivities[0].boxes.shape[1])
    width, length = len(chosen), len(sensitivities[0].boxes)
    at = {number: slice(width * place, width * (place + 1)) for place, number in enumerate(dict.fromkeys(numbers))}
    spans = {number: each.spans[chosen] for number, each in zip(numbers, sensitivities, strict=True)}
    present = {(model.trial.scale, model.trial.name): number for model, number in zip(models, numbers, strict=True)}
    columns = np.zeros((len(models), length, width * len(at)))
    absent: dict[tuple[CommonScale, str], np.ndarray] = {}
    for row, (model, each, number) in enumerate(zip(models, sensitivities, numbers, strict=True)):
        columns[row, :, at[number]] += each.boxes[:, chosen]
        scale = model.trial.scale
        if scale is None:
            columns[row, :, at[number]] += np.outer(each.scale, spans[number])
            continue
        slope = each.scale[:, 0] / len(scale.names)
        for name in scale.names:
            if (scale, name) in present:
                other = present[scale, name]
                columns[row, :, at[other]] += np.outer(slope, spans[other])
            else:
                column = absent.setdefault((scale, name), np.zeros((len(models), length)))
                column[row] += slope * float(np.linalg.norm(each.spans))
    more = [column.reshape(-1, 1) for column in absent.values()]
    return np.hstack([columns.reshape(len(models) * length, -1), *more])
