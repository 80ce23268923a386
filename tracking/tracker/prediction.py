"""Where each marker should be in the next frame, and how far off that may be."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

_MEMORY = 3  # frames that the motion is carried on from
_PAST_SPREAD = 3.0  # the gate holds this many typical errors of the predictions so far
_FORGET = 0.95  # of a typical error, frame by frame
_GROWTH = 0.35  # of the gate with every frame a marker was not seen
_FADE = 0.7  # of the velocity with every frame a marker was not seen
_WIDEST = 5.0  # the gate never exceeds this many diameters
_STATE = ("past", "times", "unseen", "seen", "error_px")


@dataclass(frozen=True, eq=False)
class Prediction:
    """Where to look for m markers.

    Attributes:
        position_px: (m, 2).
        gate_px: (m,) how far from there a spot may be.
    """

    position_px: np.ndarray
    gate_px: np.ndarray


class Motion:
    """The recent motion of m markers.

    A marker seen in the last three frames is carried on with its velocity and acceleration, which follows a tail beat
    of 2.25 Hz at 60 frames a second to about a pixel. A marker that was not seen moves with the two nearest markers
    that were, as if the three were one rigid piece, and its own velocity relative to them fades.

    Args:
        position_px: (m, 2) in the first frame.
        diameter_px: (m,) of the markers.
    """

    def __init__(self, position_px: np.ndarray, diameter_px: np.ndarray) -> None:
        self._past = np.repeat(position_px[None].astype(float), _MEMORY, axis=0)  # (3, m, 2), newest first
        self._unseen = np.zeros(len(position_px), int)  # frames in a row
        self._seen = np.ones(len(position_px), int)  # frames in a row, up to `_MEMORY`
        self._error_px = 0.5 * diameter_px  # typical, of predictions
        self._times = np.array([0.0, -1.0, -2.0])  # of `_past`, in frames

    @property
    def unseen(self) -> np.ndarray:
        """(m,) for how many frames each marker has not been seen."""
        return self._unseen

    @property
    def position_px(self) -> np.ndarray:
        """(m, 2) where each marker is or was thought to be, last."""
        return self._past[0]

    def predict(self, diameter_px: np.ndarray, frames: float = 1.0) -> Prediction:
        """Where to look after so many frames; the gate grows with the errors so far and while a marker is unseen."""
        steady = _extrapolated(self._times, frames) @ self._past.reshape(_MEMORY, -1)
        position = np.where((self._seen >= _MEMORY)[:, None], steady.reshape(-1, 2), self._past[0])
        velocity = (self._past[0] - self._past[1]) * frames / (self._times[0] - self._times[1])
        position = np.where((self._seen == 2)[:, None], self._past[0] + velocity, position)
        lost = self._unseen > 0
        if lost.any():
            position[lost] = self._with_neighbours(position, lost, velocity)[lost]
        gate = np.maximum(0.5 * diameter_px, _PAST_SPREAD * self._error_px * max(frames, 1.0))
        gate = gate * (1 + _GROWTH * self._unseen)
        gate = np.where(self._seen + self._unseen < 2, np.maximum(gate, 1.5 * diameter_px), gate)
        return Prediction(position, np.minimum(gate, _WIDEST * diameter_px))

    def update(self, predicted_px: np.ndarray, measured_px: np.ndarray, seen: np.ndarray, frames: float = 1.0) -> None:
        """Takes in a frame.

        Args:
            predicted_px: (m, 2) what `predict` said.
            measured_px: (m, 2) where a marker was seen; else anything.
            seen: (m,) bool.
            frames: since the frame before.
        """
        position = np.where(seen[:, None], measured_px, predicted_px)
        error = np.linalg.norm(measured_px - predicted_px, axis=1)
        trusted = seen & (self._seen >= _MEMORY)
        self._error_px = np.where(trusted, np.maximum(error, _FORGET * self._error_px), self._error_px)
        self._past = np.concatenate([position[None], self._past[:-1]])
        self._times = np.concatenate([[0.0], self._times[:-1] - frames])
        self._unseen = np.where(seen, 0, self._unseen + 1)
        self._seen = np.where(seen, np.minimum(self._seen + 1, _MEMORY), 0)

    def state(self) -> dict[str, np.ndarray]:
        """All it knows, as arrays."""
        return {name: getattr(self, f"_{name}") for name in _STATE}

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray]) -> "Motion":
        """The motion whose `state` this was."""
        motion = cls(state["past"][0], state["error_px"])
        for name in _STATE:
            setattr(motion, f"_{name}", state[name])
        return motion

    def put(self, marker: int, position_px: np.ndarray) -> None:
        """A person says where a marker is: its motion starts anew there."""
        self._past[:, marker] = position_px
        self._unseen[marker], self._seen[marker] = 0, 1

    def _with_neighbours(self, position: np.ndarray, lost: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """(m, 2) positions, the lost ones carried along by the two nearest markers that are seen."""
        result = position.copy()
        there = np.flatnonzero(~lost)
        for marker in np.flatnonzero(lost):
            own = velocity[marker] * _FADE
            if len(there) < 2:
                result[marker] = self._past[0, marker] + own
                continue
            near = there[np.argsort(np.linalg.norm(self._past[0, there] - self._past[0, marker], axis=1))[:2]]
            result[marker] = _carried(self._past[0, marker], self._past[0, near], position[near])
        return result


def _carried(point: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """(2,) a point moved as rigidly as two others (2, 2) moved."""
    old, new = before[1] - before[0], after[1] - after[0]
    turn = np.arctan2(new[1], new[0]) - np.arctan2(old[1], old[0])
    cos, sin = np.cos(turn), np.sin(turn)
    relative = point - before[0]
    return after[0] + np.array([cos * relative[0] - sin * relative[1], sin * relative[0] + cos * relative[1]])


def _extrapolated(times: np.ndarray, ahead: float) -> np.ndarray:
    """(3,) weights of the values at three times, for the parabola through them at a later time (Lagrange)."""
    weights = np.ones(len(times))
    for i, own in enumerate(times):
        for other in np.delete(times, i):
            weights[i] *= (ahead - other) / (own - other)
    return weights
