"""The motion of each marker: where it is expected in the next frame, and how far off that may be."""

from dataclasses import dataclass

import numpy as np

_MEMORY = 3  # frames that the motion is carried on from
_PAST_SPREAD = 3.0  # the gate holds this many typical errors of the predictions so far
_FORGET = 0.95  # share of a typical error that is kept, frame by frame
_GROWTH = 0.35  # relative growth of the gate with every frame a marker was not seen
_FADE = 0.7  # share of the velocity kept with every frame a marker was not seen
_WIDEST = 5.0  # the gate never exceeds this many diameters
_FIRST = 1.5, 0.5  # the first gates: diameters at least, and the share of the way to the nearest marker
_KEEP_BEAT = 0.98  # share of the known beat that is kept, frame by frame
_BEAT = 0.002, 2 * np.pi / 8  # slowest and fastest, rad a frame; slower ones are parabolas


@dataclass(frozen=True, eq=False)
class Prediction:
    """Where to look for m markers."""

    position_px: np.ndarray  # (m, 2)
    gate_px: np.ndarray  # (m,) how far from there a spot may be
    velocity_px: np.ndarray  # (m, 2) a frame, there


@dataclass(eq=False)
class Motion:
    """The recent motion of m markers.

    A marker seen in the last three frames is carried on along the constant and sine through them, at the one frequency
    of all markers. In equal steps its velocities follow v[k+1] = 2 cos(beat) v[k] - v[k-1], of which least squares over
    the frames so far give the beat; a beat of 0 is the parabola. A marker that was not seen moves with the two nearest
    markers that were, as if the three were one rigid piece, and its own velocity relative to them fades.
    """

    past: np.ndarray  # (3, m, 2) where each marker was or was thought to be, px, newest first
    times: np.ndarray  # (3,) of these, in frames
    unseen: np.ndarray  # (m,) for how many frames in a row each marker has not been seen
    seen: np.ndarray  # (m,) for how many it has been, up to 3
    error_px: np.ndarray  # (m,) typical, of predictions
    beat: np.ndarray  # (2,) sums over the past, of v[k] (v[k+1] + v[k-1]) and of v[k]^2

    @classmethod
    def begin(cls, position_px: np.ndarray, diameter_px: np.ndarray) -> "Motion":
        """Start the motion of markers of (m,) diameters at (m, 2) in the first frame."""
        m = len(position_px)
        past = np.repeat(position_px[None].astype(float), _MEMORY, axis=0)
        return cls(past, np.array([0.0, -1.0, -2.0]), np.zeros(m, int), np.ones(m, int), 0.5 * diameter_px, np.zeros(2))

    def predict(self, diameter_px: np.ndarray, frames: float = 1.0) -> Prediction:
        """Predict where to look after so many frames; the gate grows with the errors and while a marker is unseen."""
        weights = _extrapolated(self.times, frames, self._beat_rad)
        steady = (weights @ self.past.reshape(_MEMORY, -1)).reshape(-1, 2)
        position = np.where((self.seen >= _MEMORY)[:, None], steady, self.past[0])
        velocity = (self.past[0] - self.past[1]) * frames / (self.times[0] - self.times[1])
        position = np.where((self.seen == 2)[:, None], self.past[0] + velocity, position)
        lost = self.unseen > 0
        if lost.any():
            position[lost] = self._with_neighbours(position, lost, velocity)[lost]
        gate = np.maximum(0.5 * diameter_px, _PAST_SPREAD * self.error_px * max(frames, 1.0))
        gate = gate * (1 + _GROWTH * self.unseen)
        if (new := self.seen + self.unseen < _MEMORY).any():
            gate = np.where(new, np.maximum(gate, self._first_gate(diameter_px)), gate)
        return Prediction(position, np.minimum(gate, _WIDEST * diameter_px), self.velocity(position, frames))

    def velocity(self, position_px: np.ndarray, frames: float) -> np.ndarray:
        """Return (m, 2) px a frame, of markers that are at (m, 2) after so many frames."""
        step = (position_px - self.past[0]) / frames
        before = (self.past[0] - self.past[1]) / (self.times[0] - self.times[1])
        return step + np.where((self.seen >= 2)[:, None], (step - before) / 2, 0.0)

    def update(self, predicted_px: np.ndarray, measured_px: np.ndarray, seen: np.ndarray, frames: float = 1.0) -> None:
        """Update with a frame: where each marker was predicted and, if seen (m,), measured, (m, 2) each."""
        position = np.where(seen[:, None], measured_px, predicted_px)
        error = np.linalg.norm(measured_px - predicted_px, axis=1)
        trusted = seen & (self.seen >= _MEMORY)
        self.error_px = np.where(trusted, np.maximum(error, _FORGET * self.error_px), self.error_px)
        self._learn_beat(position, frames, seen & (self.seen >= _MEMORY))
        self.past = np.concatenate([position[None], self.past[:-1]])
        self.times = np.concatenate([[0.0], self.times[:-1] - frames])
        self.unseen = np.where(seen, 0, self.unseen + 1)
        self.seen = np.where(seen, np.minimum(self.seen + 1, _MEMORY), 0)

    @property
    def _beat_rad(self) -> float:
        twice_cos, slow_fast = self.beat[0] / max(self.beat[1], 1e-9), 2 * np.cos(_BEAT)
        return float(np.arccos(np.clip(twice_cos, *slow_fast[::-1]) / 2)) if self.beat[1] > 0 else _BEAT[0]

    def _learn_beat(self, position_px: np.ndarray, frames: float, which: np.ndarray) -> None:
        """Learn the beat from markers (m, 2) that were seen now and in the last three frames, in about equal steps."""
        steps = -np.diff(self.times, prepend=frames)  # (3,)
        if which.any() and np.ptp(steps) < 0.1:
            now, last, before = -np.diff(np.concatenate([position_px[None], self.past])[:, which], axis=0)  # (3, k, 2)
            self.beat = _KEEP_BEAT * self.beat + [np.sum(last * (now + before)), np.sum(last * last)]

    def _first_gate(self, diameter_px: np.ndarray) -> np.ndarray:
        """Return (m,) gates of markers of unknown acceleration: nearer to them than to others they may be anywhere."""
        apart = np.linalg.norm(self.past[0][:, None] - self.past[0][None], axis=2)
        nearest = np.sort(apart, axis=1)[:, 1] if len(apart) > 1 else 0.0
        least, share = _FIRST
        return np.maximum(least * diameter_px, share * nearest)

    def _with_neighbours(self, position: np.ndarray, lost: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return (m, 2) positions, the lost ones carried along by the two nearest markers that are seen."""
        result = position.copy()
        there = np.flatnonzero(~lost)
        for marker in np.flatnonzero(lost):
            own = velocity[marker] * _FADE
            if len(there) < 2:
                result[marker] = self.past[0, marker] + own
                continue
            near = there[np.argsort(np.linalg.norm(self.past[0, there] - self.past[0, marker], axis=1))[:2]]
            result[marker] = _carried(self.past[0, marker], self.past[0, near], position[near])
        return result


def _carried(point: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return (2,) a point moved as rigidly as two others (2, 2) moved."""
    old, new = before[1] - before[0], after[1] - after[0]
    turn = np.arctan2(new[1], new[0]) - np.arctan2(old[1], old[0])
    cos, sin = np.cos(turn), np.sin(turn)
    relative = point - before[0]
    return after[0] + np.array([cos * relative[0] - sin * relative[1], sin * relative[0] + cos * relative[1]])


def _extrapolated(times: np.ndarray, ahead: float, beat_rad: float) -> np.ndarray:
    """Return (3,) weights of the values at three times, for the constant and sine through them at a later time."""
    past, then = (np.array([np.ones_like(t), np.cos(t), np.sin(t)]) for t in (beat_rad * times, beat_rad * ahead))
    return np.linalg.solve(past, then)
