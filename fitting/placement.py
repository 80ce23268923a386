"""Placement fit: offsets of the boxes of nose and neck in each trial, and of all other markers, common to all trials.

The head frame is defined by two boxes that were placed by hand. An error there turns, scales and shifts all else of
that trial (the path is not shifted): one similarity transform for each trial. An error that all trials share is a
marker whose place on its link differs from the robot's description; it turns with the link. Both enter a simulated
shape linearly to first order, so the estimate has a closed form: ridge regression with priors for the errors of hands
and rulers, reweighted for the mean distance (Weiszfeld 1937). Boxes and markers explain what all trials share equally
well; there the prior decides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.trial import MeasuredTrial
from tracking import HeadFrame

BOX_SD_M = 0.005  # of the box of nose or neck, each way: 4 to 6 mm over all five public trials of the real robot
MARKER_SD_M = 0.010  # of a marker from its described place, each way: 11 to 12 mm there
_ERROR_SD_M = (0.001, 0.010)  # of one beat, of the residual: least, initial
_MEAN_DISTANCE = np.sqrt(np.pi / 2)  # of errors of unit standard deviation each way
_REWEIGHTED = 3
_SOFTENING_M = 0.004  # distances below are quadratic
_SPAN_M = 0.142  # between nose and neck, about
_OF_BOXES = np.array(
    [
        [1 / _SPAN_M, 0.0, -1 / _SPAN_M, 0.0],  # larger, as the span is taken for that of the robot
        [0.0, 1 / _SPAN_M, 0.0, -1 / _SPAN_M],  # turned
        [-1.0, 0.0, 0.0, 0.0],  # shifted along
        [0.0, -1.0, 0.0, 0.0],  # shifted across
    ]
)  # effect of boxes a metre off (columns, see `Placement.boxes_m`) on all else, to first order
_OWN = 4  # unknowns of a trial


@dataclass(frozen=True, eq=False)
class Placement:
    """Estimated offsets of boxes and markers.

    Attributes:
        boxes_m: (4,) by the trial's name: how far the boxes of nose (along, across) and neck (along, across) sit from
            their markers, in the head frame: along is towards the neck, across to the right of the way it swims.
        marker_m, marker_sd_m: (m, 2) offset of each marker from its described place, along its link and across, and
            standard deviations; 0 for nose and neck, which define the frame.
    """

    boxes_m: Mapping[str, np.ndarray]
    marker_m: np.ndarray
    marker_sd_m: np.ndarray

    def seen(self, trial: MeasuredTrial, head: HeadFrame) -> HeadFrame:
        """A simulation (n, m, 2) of a trial as tracks with such offsets would show it."""
        free, boxes_m = _free(trial), self.boxes_m[trial.name]
        own = _OF_BOXES @ boxes_m
        features, links = _features(head.shape_m[:, free]), _links(trial, head.shape_m)[:, free]
        shape = np.array(head.shape_m)
        shape[:, free] += features @ boxes_m
        shape[:, free] += np.einsum("nicd,id->nic", links, self.marker_m[free])
        path = head.path_m + own[0] * head.path_m + own[1] * _quarter(head.path_m)
        return replace(head, position_m=shape + path[:, None], shape_m=shape, path_m=path)


def place(
    trials: Sequence[MeasuredTrial],
    simulated: Sequence[HeadFrame],
    frames: Sequence[np.ndarray] | None = None,
    known: Placement | None = None,
) -> Placement:
    """The placement with the highest posterior density, given one simulation of each trial.

    Args:
        trials: t measured.
        simulated: (n, m, 2) of each.
        frames: (n,) of each trial, those used; default: the scored ones.
        known: fitted to other trials of the same robot, a prior for its markers; default: only the priors.
    """
    used = [trial.scored for trial in trials] if frames is None else frames
    free = _free(trials[0])
    shapes = [_Shapes.of(t, head.shape_m, each) for t, head, each in zip(trials, simulated, used, strict=True)]
    prior = None if known is None else (known.marker_m[free].ravel(), known.marker_sd_m[free].ravel())
    found, covariance = _likeliest(shapes, prior)
    size = _OWN * len(trials)
    marker_m, marker_sd_m = np.zeros((2, len(trials[0].markers), 2))
    marker_m[free] = found[size:].reshape(-1, 2)
    marker_sd_m[free] = np.sqrt(np.diagonal(covariance)[size:]).reshape(-1, 2)
    boxes_m = dict(zip([trial.name for trial in trials], found[:size].reshape(-1, _OWN), strict=True))
    return Placement(boxes_m, marker_m, marker_sd_m)


@dataclass(frozen=True, eq=False)
class _Shapes:
    """All markers but nose and neck of one trial.

    Attributes:
        off: (k, i, 2) measured less simulated, m; 0 where either is not known.
        features: (k, i, 2, 4) effect of boxes that are a metre off.
        links: (k, i, 2, 2) axes of each marker's link.
        weight: (k, i) in beats, evenly over the frames of each marker.
    """

    off: np.ndarray
    features: np.ndarray
    links: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, trial: MeasuredTrial, shape_m: np.ndarray, frames: np.ndarray) -> "_Shapes":
        free = _free(trial)
        simulated, measured = shape_m[frames[: len(shape_m)]], trial.head.shape_m[frames][:, free]
        off = measured - simulated[:, free]
        good = (trial.weight[frames][:, free] > 0) & np.isfinite(off).all(axis=-1)
        beats = float(frames.sum() * np.median(np.diff(trial.time_s))) * trial.start_frequency.hz
        share = good / np.maximum(good.sum(axis=0), 1)
        features, links = _features(simulated[:, free]), _links(trial, simulated)[:, free]
        return cls(np.nan_to_num(off), np.nan_to_num(features), np.nan_to_num(links), share * beats)


def _likeliest(
    shapes: Sequence[_Shapes], markers: tuple[np.ndarray, np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(p,) four numbers of each trial and then (2 i) of the markers, and their (p, p) covariance.

    Args:
        shapes: of each trial.
        markers: (2 i,) prior means and standard deviations of the markers.
    """
    count = shapes[0].off.shape[1]
    size, total = _OWN * len(shapes), max(sum(float(each.weight.sum()) for each in shapes), 1e-12)
    mean, sd = (np.zeros(2 * count), np.full(2 * count, MARKER_SD_M)) if markers is None else markers
    precision = np.append(np.full(size, BOX_SD_M), sd) ** -2.0
    found = prior = np.append(np.zeros(size), mean)
    error_sd = _ERROR_SD_M[1]
    for _ in range(_REWEIGHTED):
        distances, normal, against = 0.0, np.diag(precision), precision * prior
        for number, each in enumerate(shapes):
            own = slice(_OWN * number, _OWN * (number + 1))
            error = each.off - each.features @ found[own]
            error = error - np.einsum("kicd,id->kic", each.links, found[size:].reshape(count, 2))
            square = (error**2).sum(axis=-1)  # (k, i)
            distances += float((each.weight * np.sqrt(square)).sum()) / total
            weight = each.weight / (error_sd * np.sqrt(square + _SOFTENING_M**2))
            normal[own, own] += np.einsum("ki,kicp,kicq->pq", weight, each.features, each.features)
            against[own] += np.einsum("ki,kicp,kic->p", weight, each.features, each.off)
            cross = np.einsum("ki,kicp,kicd->pid", weight, each.features, each.links).reshape(_OWN, -1)
            normal[own, size:] += cross
            normal[size:, own] += cross.T
            normal[size:, size:] += np.diag(np.repeat(weight.sum(axis=0), 2))
            against[size:] += np.einsum("ki,kicd,kic->id", weight, each.links, each.off).ravel()
        found = np.linalg.solve(normal, against)
        error_sd = max(distances / _MEAN_DISTANCE, _ERROR_SD_M[0])
    return found, np.linalg.inv(normal)


def _features(shape: np.ndarray) -> np.ndarray:
    """(..., 2, 4) effect of boxes that are a metre off on points (..., 2)."""
    unit = np.broadcast_to(np.eye(2), (*shape.shape, 2))
    return np.concatenate([shape[..., None], _quarter(shape)[..., None], unit], axis=-1) @ _OF_BOXES


def _links(trial: MeasuredTrial, shape_m: np.ndarray) -> np.ndarray:
    """(..., m, 2, 2) axes, in columns along and across, of the link of each marker in shapes (..., m, 2).

    Those on the head have its own; a link of the tail has the direction from the marker before to the one behind.
    """
    tail = list(trial.tail)
    along = np.broadcast_to(np.array([1.0, 0.0]), shape_m.shape).copy()
    if len(tail) > 1:
        before, behind = [tail[0], *tail[:-1]], [*tail[1:], tail[-1]]
        line = shape_m[..., behind, :] - shape_m[..., before, :]
        along[..., tail, :] = line / np.maximum(np.linalg.norm(line, axis=-1, keepdims=True), 1e-9)
    return np.stack([along, _quarter(along)], axis=-1)


def _quarter(points: np.ndarray) -> np.ndarray:
    """(..., 2) turned by a quarter counter-clockwise."""
    return np.stack([-points[..., 1], points[..., 0]], axis=-1)


def _free(trial: MeasuredTrial) -> list[int]:
    """All markers but nose and neck."""
    return [i for i, name in enumerate(trial.markers) if name not in ("nose", "neck")]
