"""Where boxes were put: those of nose and neck anew in every trial, all other markers the same in all.

The head frame hangs on two boxes that a hand has placed. Where they are off, everything else of that trial is turned,
scaled and shifted by the same amount (the path too, but for the shift), and that is all they can do: a similarity
transform a trial. What is the same in all trials is not a box but a marker that sits elsewhere on its link than the
robot's description has it, and turns with the link. Both enter a simulated shape to first order linearly, so the
likeliest come in closed form: ridge regression with priors as wide as hands and rulers are off, reweighted for the mean
distance (Weiszfeld 1937). Errors are those of its posterior: what all trials share, boxes and markers explain alike,
and there the prior decides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fitting.trial import MeasuredTrial
from tracking import HeadFrame

BOX_SD_M = 0.005  # of the box of nose or neck, each way: 4 to 6 mm over all five public trials of the real robot
MARKER_SD_M = 0.010  # of a marker from its described place, each way: 11 to 12 mm there
_ERROR_SD_M = (0.001, 0.010)  # of one beat, of what neither explains: at least; to begin with
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
)  # what boxes that sit a metre off (columns, see `BoxesOff`) do to all else, to first order
_OWN = 4  # unknowns of a trial


class BoxesOff(NamedTuple):
    """How far the boxes of nose and neck of one trial sit from their markers, in the head frame, m.

    Attributes:
        nose_along, nose_across: of the nose's, towards the neck, and to the right of the way it swims.
        neck_along, neck_across: of the neck's.
    """

    nose_along: float = 0.0
    nose_across: float = 0.0
    neck_along: float = 0.0
    neck_across: float = 0.0

    @property
    def turn_rad(self) -> float:
        """By which everything else of the trial is turned, counter-clockwise from above, rad."""
        return float(np.angle(self._similarity))

    @property
    def scale(self) -> float:
        """By which everything else of the trial, the path too, seems larger."""
        return float(np.abs(self._similarity))

    @property
    def _similarity(self) -> complex:
        larger, turned = _OF_BOXES[:2] @ np.array(self)
        return complex(1 + larger, turned)


@dataclass(frozen=True, eq=False)
class Placement:
    """Where boxes were put, and standard deviations of that.

    Attributes:
        boxes, boxes_sd: by the trial's name.
        marker_m, marker_sd_m: (m, 2) of each marker beside its described place, along its link and across; 0 for nose
            and neck, which the frame hangs on.
    """

    boxes: Mapping[str, BoxesOff]
    boxes_sd: Mapping[str, BoxesOff]
    marker_m: np.ndarray
    marker_sd_m: np.ndarray

    def seen(self, trial: MeasuredTrial, head: HeadFrame) -> HeadFrame:
        """A simulation (n, m, 2) of a trial as tracks with boxes put so would show it."""
        free, own = _free(trial), _OF_BOXES @ np.array(self.boxes[trial.name])
        features, links = _features(head.shape_m[:, free]), _links(trial, head.shape_m)[:, free]
        shape = np.array(head.shape_m)
        shape[:, free] += features @ np.array(self.boxes[trial.name])
        shape[:, free] += np.einsum("nicd,id->nic", links, self.marker_m[free])
        path = head.path_m + own[0] * head.path_m + own[1] * _quarter(head.path_m)
        return replace(head, position_m=shape + path[:, None], shape_m=shape, path_m=path)


def place(
    trials: Sequence[MeasuredTrial],
    simulated: Sequence[HeadFrame],
    frames: Sequence[np.ndarray] | None = None,
    known: Placement | None = None,
) -> Placement:
    """The likeliest placement, given one simulation of each trial.

    Args:
        trials: t measured.
        simulated: (n, m, 2) of each.
        frames: (n,) of each trial, those that may tell; default: the scored ones.
        known: of other trials, whose markers are these trials' too; default: nothing is known but the priors.
    """
    told = [trial.scored for trial in trials] if frames is None else frames
    free = _free(trials[0])
    shapes = [_Shapes.of(t, head.shape_m[None], each) for t, head, each in zip(trials, simulated, told, strict=True)]
    prior = None if known is None else (known.marker_m[free].ravel(), known.marker_sd_m[free].ravel())
    found, covariance = _likeliest(shapes, prior)
    own, sd = found[0], np.sqrt(np.diagonal(covariance[0]))
    names, size = [trial.name for trial in trials], _OWN * len(trials)
    marker_m, marker_sd_m = np.zeros((2, len(trials[0].markers), 2))
    marker_m[free], marker_sd_m[free] = own[size:].reshape(-1, 2), sd[size:].reshape(-1, 2)
    boxes, boxes_sd = (
        dict(zip(names, [BoxesOff(*map(float, each)) for each in part[:size].reshape(-1, _OWN)], strict=True))
        for part in (own, sd)
    )
    return Placement(boxes, boxes_sd, marker_m, marker_sd_m)


@dataclass(frozen=True, eq=False)
class _Shapes:
    """All markers but nose and neck of one trial.

    Attributes:
        off: (s, k, i, 2) measured less simulated, m; 0 where either is not known.
        features: (s, k, i, 2, 4) what boxes that sit a metre off would do.
        links: (s, k, i, 2, 2) axes of each marker's link.
        weight: (s, k, i) in beats, evenly over the frames of each marker.
    """

    off: np.ndarray
    features: np.ndarray
    links: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, trial: MeasuredTrial, shape_m: np.ndarray, frames: np.ndarray) -> "_Shapes":
        free, told = _free(trial), frames[: shape_m.shape[1]]
        simulated, measured = shape_m[:, told], trial.head.shape_m[frames][:, free]
        off = measured - simulated[:, :, free]
        good = (trial.weight[frames][:, free] > 0) & np.isfinite(off).all(axis=-1)
        beats = float(frames.sum() * np.median(np.diff(trial.time_s))) * trial.start_frequency.hz
        share = good / np.maximum(good.sum(axis=1, keepdims=True), 1)
        features, links = _features(simulated[:, :, free]), _links(trial, simulated)[:, :, free]
        return cls(np.nan_to_num(off), np.nan_to_num(features), np.nan_to_num(links), share * beats)


def _likeliest(
    shapes: Sequence[_Shapes], markers: tuple[np.ndarray, np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(s, p) four numbers of each trial and then (2 i) of the markers, and their (s, p, p) covariances.

    Args:
        shapes: of each trial.
        markers: (2 i,) means and standard deviations of what is known of markers.
    """
    columns, _, count, _ = shapes[0].off.shape
    size, total = _OWN * len(shapes), np.maximum(sum(each.weight.sum(axis=(1, 2)) for each in shapes), 1e-12)
    mean, sd = (np.zeros(2 * count), np.full(2 * count, MARKER_SD_M)) if markers is None else markers
    precision = np.append(np.full(size, BOX_SD_M), sd) ** -2.0
    found: np.ndarray = np.tile(np.append(np.zeros(size), mean), (columns, 1))
    error_sd = np.full(columns, _ERROR_SD_M[1])
    for _ in range(_REWEIGHTED):
        distances = np.zeros(columns)
        normal = np.tile(np.diag(precision), (columns, 1, 1))
        against = np.tile(precision * np.append(np.zeros(size), mean), (columns, 1))
        for number, each in enumerate(shapes):
            own = slice(_OWN * number, _OWN * (number + 1))
            error = each.off - np.einsum("skicp,sp->skic", each.features, found[:, own])
            error = error - np.einsum("skicd,sid->skic", each.links, found[:, size:].reshape(columns, count, 2))
            square = (error**2).sum(axis=-1)  # (s, k, i)
            distances += (each.weight * np.sqrt(square)).sum(axis=(1, 2)) / total
            weight = each.weight / (error_sd[:, None, None] * np.sqrt(square + _SOFTENING_M**2))
            normal[:, own, own] += np.einsum("ski,skicp,skicq->spq", weight, each.features, each.features)
            against[:, own] += np.einsum("ski,skicp,skic->sp", weight, each.features, each.off)
            cross = np.einsum("ski,skicp,skicd->spid", weight, each.features, each.links).reshape(columns, _OWN, -1)
            normal[:, own, size:] += cross
            normal[:, size:, own] += cross.transpose(0, 2, 1)
            places = np.arange(size, size + 2 * count)
            normal[:, places, places] += np.repeat(weight.sum(axis=1), 2, axis=1)
            against[:, size:] += np.einsum("ski,skicd,skic->sid", weight, each.links, each.off).reshape(columns, -1)
        found = np.linalg.solve(normal, against[..., None])[..., 0]
        error_sd = np.maximum(distances / _MEAN_DISTANCE, _ERROR_SD_M[0])
    return found, np.linalg.inv(normal)


def _features(shape: np.ndarray) -> np.ndarray:
    """(..., 2, 4) what boxes that sit a metre off do to points (..., 2)."""
    unit = np.broadcast_to(np.eye(2), (*shape.shape, 2))
    return np.concatenate([shape[..., None], _quarter(shape)[..., None], unit], axis=-1) @ _OF_BOXES


def _links(trial: MeasuredTrial, shape_m: np.ndarray) -> np.ndarray:
    """(..., m, 2, 2) axes, in columns along and across, of the link of each marker in shapes (..., m, 2).

    Those on the head have its own; on the tail a link lies as the line from the marker before to the one behind.
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
