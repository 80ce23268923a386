"""Where boxes were put: those of nose and neck anew in every trial, all other markers the same in all.

The head frame hangs on two boxes that a hand has placed. Where they are off, everything else of that trial is turned,
scaled and shifted by the same amount (the path too, but for the shift), and that is all they can do: a similarity
transform a trial. What is the same in all trials is not a box but a marker that sits elsewhere on the body than the
robot's description has it. Both enter a simulated shape to first order linearly, so the likeliest come in closed form:
ridge regression with priors as wide as hands and rulers are off, reweighted for the mean distance (Weiszfeld 1937).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fitting.mean_distance import SOFTENING_M
from fitting.scoring import residuals
from fitting.trial import MeasuredTrial
from tracking import HeadFrame

BOX_SD_M = 0.005  # of the box of nose or neck, each way: 4 to 6 mm on the public trials of the real robot
MARKER_SD_M = 0.010  # of a marker from its described place, each way: 11 to 12 mm there
_ERROR_SD_M = (0.001, 0.010)  # of one beat, of what neither explains: at least; to begin with
_MEAN_DISTANCE = np.sqrt(np.pi / 2)  # of errors of unit standard deviation each way
_REWEIGHTED = 3
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
_FEWEST_BEATS = 3  # from which they tell how much beats differ


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

    def seen(self, points_m: np.ndarray) -> np.ndarray:
        """(..., 2) turned and scaled, not shifted."""
        like = self._similarity
        return points_m @ np.array([[like.real, like.imag], [-like.imag, like.real]])

    @property
    def shift_m(self) -> np.ndarray:
        """(2,) by which everything but nose, neck and path is shifted, along and across, m."""
        return -np.array([self.nose_along, self.nose_across])

    @property
    def _similarity(self) -> complex:
        larger, turned = _OF_BOXES[:2] @ np.array(self)
        return complex(1 + larger, turned)


@dataclass(frozen=True, eq=False)
class Placement:
    """Where boxes were put.

    Attributes:
        boxes: by the trial's name.
        marker_m: (m, 2) of each marker beside its described place, along and across; 0 for nose and neck, which the
            frame hangs on.
    """

    boxes: Mapping[str, BoxesOff]
    marker_m: np.ndarray

    def seen(self, trial: MeasuredTrial, head: HeadFrame) -> HeadFrame:
        """A simulation (n, m, 2) of a trial as tracks with boxes put so would show it."""
        off, free = self.boxes[trial.name], _free(trial)
        shape = np.array(head.shape_m)
        shape[:, free] = off.seen(shape[:, free]) + self.marker_m[free] + off.shift_m
        path = off.seen(head.path_m)
        return replace(head, position_m=shape + path[:, None], shape_m=shape, path_m=path)


def place(
    trials: Sequence[MeasuredTrial],
    simulated: Sequence[HeadFrame],
    frames: Sequence[np.ndarray] | None = None,
    marker_m: np.ndarray | None = None,
) -> Placement:
    """The likeliest placement, given one simulation of each trial.

    Args:
        trials: t measured.
        simulated: (n, m, 2) of each.
        frames: (n,) of each trial, those that may tell; default: the scored ones.
        marker_m: (m, 2) where markers are beside their places, if that is known; default: found from the trials.
    """
    told = [trial.scored for trial in trials] if frames is None else frames
    free = _free(trials[0])
    beside = np.zeros((len(trials[0].markers), 2)) if marker_m is None else marker_m
    shapes = [
        _Shapes.of(trial, head.shape_m[None] + beside, each)
        for trial, head, each in zip(trials, simulated, told, strict=True)
    ]
    found = _likeliest(shapes, marker_m is None)[0]
    own = found[: _OWN * len(trials)].reshape(-1, _OWN)
    boxes = {trial.name: BoxesOff(*map(float, each)) for trial, each in zip(trials, own, strict=True)}
    moved = np.array(beside)
    if marker_m is None:
        moved[free] = found[_OWN * len(trials) :].reshape(-1, 2)
    return Placement(boxes, moved)


def placement_sd(
    trials: Sequence[MeasuredTrial],
    simulated: Sequence[HeadFrame],
    frames: Sequence[np.ndarray] | None = None,
    marker_m: np.ndarray | None = None,
) -> Placement:
    """Standard errors of what `place` finds, by leaving out each beat in turn (jackknife; Tukey 1958).

    Errors that last longer than a beat, such as a body that differs from the twin's, are not in them. A trial of fewer
    than three beats has nan, and adds nothing to the errors of others.
    """
    told = [trial.scored for trial in trials] if frames is None else frames
    boxes, markers, few = np.zeros((len(trials), _OWN)), np.zeros((len(trials[0].markers), 2)), []
    for number, (trial, own) in enumerate(zip(trials, told, strict=True)):
        beats = _beats(trial, own)
        if len(beats) < _FEWEST_BEATS:
            few.append(number)
            continue
        without = [
            place(trials, simulated, [*told[:number], own & ~beat, *told[number + 1 :]], marker_m) for beat in beats
        ]
        boxes += (len(beats) - 1) * np.var([list(each.boxes.values()) for each in without], axis=0)
        markers += (len(beats) - 1) * np.var([each.marker_m for each in without], axis=0)
    boxes[few] = np.nan
    spread = [BoxesOff(*map(float, each)) for each in np.sqrt(boxes)]
    return Placement(dict(zip([trial.name for trial in trials], spread, strict=True)), np.sqrt(markers))


def placed_residuals(trials: Sequence[MeasuredTrial], simulated: Sequence[HeadFrame]) -> list[np.ndarray]:
    """Simulated minus measured over the k scored frames of each trial, each column with its likeliest placement.

    Args:
        trials: t measured.
        simulated: (s, n, m, 2) of each; column by column they belong together. It may end after the last scored frame.

    Returns:
        (s, k, m, 2) of each trial, m.
    """
    free = _free(trials[0])
    shapes = [_Shapes.of(t, head.shape_m, t.scored) for t, head in zip(trials, simulated, strict=True)]
    found = _likeliest(shapes, True)
    markers = found[:, _OWN * len(trials) :].reshape(len(found), 1, -1, 2)
    left = []
    for number, (trial, head) in enumerate(zip(trials, simulated, strict=True)):
        own = found[:, _OWN * number : _OWN * (number + 1)] @ _OF_BOXES.T
        larger, turned, shifted = own[:, 0, None, None], own[:, 1, None, None], own[:, None, None, 2:]
        frames = trial.scored[: head.path_m.shape[-2]]
        first = int(np.flatnonzero(frames)[0])
        path = head.path_m[:, frames] - head.path_m[:, first : first + 1]
        error = residuals(trial, head, trial.scored) + (larger * path + turned * _quarter(path))[:, :, None]
        shape = head.shape_m[:, frames][:, :, free]
        error[:, :, free] += larger[..., None] * shape + turned[..., None] * _quarter(shape) + shifted + markers
        left.append(error)
    return left


def _beats(trial: MeasuredTrial, frames: np.ndarray) -> list[np.ndarray]:
    """(n,) masks of the beats among some frames; what is less than half a beat at the end goes with the last."""
    passed = (trial.time_s - trial.time_s[frames][0]) * trial.frequency.hz + 1e-6
    count = max(round(float(passed[frames][-1])), 1)
    number = np.minimum(np.floor(passed), count - 1)
    return [frames & (number == beat) for beat in range(count)]


@dataclass(frozen=True, eq=False)
class _Shapes:
    """All markers but nose and neck: (s, k, i, 2) simulated, (k, i, 2) measured, (k, i) weights, in beats."""

    simulated: np.ndarray
    measured: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, trial: MeasuredTrial, shape_m: np.ndarray, frames: np.ndarray) -> "_Shapes":
        free, told = _free(trial), frames[: shape_m.shape[1]]
        measured = trial.head.shape_m[frames][:, free]
        good = (trial.weight[frames][:, free] > 0) & np.isfinite(measured).all(axis=-1)
        beats = float(frames.sum() * np.median(np.diff(trial.time_s))) * trial.frequency.hz
        share = good / np.maximum(good.sum(axis=0), 1)
        return cls(shape_m[:, told][:, :, free], np.nan_to_num(measured), share * beats)


def _likeliest(shapes: Sequence[_Shapes], with_markers: bool) -> np.ndarray:
    """(s, p) four numbers of each trial, and where they are free (2 i) those of the markers."""
    columns, markers = len(shapes[0].simulated), shapes[0].measured.shape[1] if with_markers else 0
    size = _OWN * len(shapes)
    prior = np.concatenate([np.full(size, BOX_SD_M), np.full(2 * markers, MARKER_SD_M)])
    found: np.ndarray = np.zeros((columns, size + 2 * markers))
    error_sd = np.full(columns, _ERROR_SD_M[1])
    for _ in range(_REWEIGHTED):
        distances = np.zeros(columns)
        normal, against = np.tile(np.diag(prior**-2.0), (columns, 1, 1)), np.zeros_like(found)
        for number, each in enumerate(shapes):
            own = slice(_OWN * number, _OWN * (number + 1))
            features = _features(each.simulated)  # (s, k, i, 2, 4)
            off = np.nan_to_num(each.measured - each.simulated)
            error = off - np.einsum("skicp,sp->skic", features, found[:, own])
            if with_markers:
                error = error - found[:, None, size:].reshape(columns, 1, markers, 2)
            distance = np.sqrt((error**2).sum(axis=-1) + SOFTENING_M**2)  # (s, k, i)
            distances += (each.weight * distance).sum(axis=(1, 2)) / sum(one.weight.sum() for one in shapes)
            weight = each.weight / (error_sd[:, None, None] * distance)
            normal[:, own, own] += np.einsum("ski,skicp,skicq->spq", weight, features, features)
            against[:, own] += np.einsum("ski,skicp,skic->sp", weight, features, off)
            if with_markers:
                cross = np.einsum("ski,skicp->spic", weight, features).reshape(columns, _OWN, 2 * markers)
                normal[:, own, size:] += cross
                normal[:, size:, own] += cross.transpose(0, 2, 1)
                each_of_two = np.repeat(weight.sum(axis=1), 2, axis=1)
                normal[:, np.arange(size, size + 2 * markers), np.arange(size, size + 2 * markers)] += each_of_two
                against[:, size:] += np.einsum("ski,skic->sic", weight, off).reshape(columns, 2 * markers)
        found = np.linalg.solve(normal, against[..., None])[..., 0]
        error_sd = np.maximum(distances / _MEAN_DISTANCE, _ERROR_SD_M[0])
    return found


def _features(shape: np.ndarray) -> np.ndarray:
    """(..., 2, 4) what boxes that sit a metre off do to points (..., 2)."""
    unit = np.broadcast_to(np.eye(2), (*shape.shape, 2))
    return np.concatenate([shape[..., None], _quarter(shape)[..., None], unit], axis=-1) @ _OF_BOXES


def _quarter(points: np.ndarray) -> np.ndarray:
    """(..., 2) turned by a quarter counter-clockwise."""
    return np.stack([-points[..., 1], points[..., 0]], axis=-1)


def _free(trial: MeasuredTrial) -> list[int]:
    """All markers but nose and neck."""
    return [i for i, name in enumerate(trial.markers) if name not in ("nose", "neck")]
