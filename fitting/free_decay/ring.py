"""A free decay in two numbers that a diagnosis reads: how stiff and how damped its hinges are over what they carry.

A released tail rings in air, beside no water and no tendons, so it tells of hinges, masses and the clock alone. The
twin is released in the pose and with the rates that the decay was found to begin with, and read in the same way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.free_decay.damped_sine import fit_damped_sine
from fitting.free_decay.decay_fit import DecayFit
from fitting.free_decay.decay_trial import DecayTrial
from fitting.free_decay.decay_twin import stable_scene
from swimmer import FREE_DECAY, Runs, Twin
from swimmer.effects import AffectedRuns, AffectedTwin, Effect

NUMBERS = 2
"""Of a decay: ln of the squared natural frequency, and ln of the rate at which the envelope falls."""
_MOVES = frozenset({"robot", "mjcf", "force", "damping", "clock"})  # ways in which an effect can change a decay
_STEP_S = 0.001
_LASTS_S, _BENT_RAD, _GUESS_HZ, _GUESS_1_S = 1.5, 0.2, 4.0, 10.0  # of one that could be filmed
TO_COME_SD = (0.012, 0.011)
"""Of its numbers: the median of 35 decays of the second simulator."""
_NO_FLUID = 5  # coefficients, which nothing in air depends on


@dataclass(frozen=True, eq=False)
class Ring:
    """How a released tail rings, beside twins that are released alike.

    Attributes:
        trial: n frames of k tail markers.
        start_rad: (2, h) hinge angles (rad) and rates (rad/s) in the first frame.
        measured: (2,) see `NUMBERS`; the first goes with stiffness over mass, the second with damping over mass.
        sd: (2,) by tracking noise.
        timestep_s: of twins that are sure to be stable; what it errs by is taken off (Richardson 1911).
    """

    trial: DecayTrial
    start_rad: np.ndarray
    measured: np.ndarray
    sd: np.ndarray
    timestep_s: float

    @classmethod
    def of(cls, trial: DecayTrial, fit: DecayFit) -> "Ring":
        """Of a decay and what was fitted to it."""
        spectrum, over = fit.spectrum, fit.damping_n_m_s / fit.stiffness_n_m
        hz_sd, rate_sd = spectrum.frequency_se_hz / spectrum.frequency_hz, spectrum.decay_se_1_s / spectrum.decay_1_s
        measured = np.array([2 * np.log(spectrum.natural_hz), np.log(spectrum.decay_1_s)])
        step_s = min(stable_scene(over / 2).timestep_s, _STEP_S)
        return cls(trial, fit.start_rad, measured, np.array([2 * hz_sd, rate_sd]), step_s)

    @classmethod
    def to_come(cls, name: str, twin: Twin, markers: tuple[str, ...], frame_s: float) -> "Ring":
        """One that could be filmed of a robot's twin: all its hinges bent alike and let go.

        Args:
            name: of the trial.
            twin: plain.
            markers: k of the tail's.
            frame_s: between two frames.
        """
        time_s = np.arange(0.0, _LASTS_S, frame_s)
        still, start = np.zeros((len(time_s), len(markers), 2)), np.zeros((2, len(twin.robot.hinges)))
        start[0] = _BENT_RAD
        trial = DecayTrial(name, markers, time_s, still, np.ones(still.shape[:2]), 0, 0.0, 1.0)
        tail = twin.robot.tail
        step_s = min(stable_scene(tail.hinge_damping_n_m_s / tail.hinge_stiffness_n_m / 2).timestep_s, _STEP_S)
        guess = cls(trial, start, np.log([_GUESS_HZ**2, _GUESS_1_S]), np.array(TO_COME_SD), step_s)
        return replace(guess, measured=guess.of_twin(twin)[0])

    @property
    def name(self) -> str:
        """Of the trial."""
        return self.trial.name

    def of_twin(self, twin: Twin, effects: Sequence[Effect] = (), values: np.ndarray | None = None) -> np.ndarray:
        """(s, 2) of twins with effects at values (s, p), one that has none by default; nan where one diverged.

        Args:
            twin: any of the robot's, which tells the markers.
            effects: with the parameters that its markers give them.
            values: of all of them.
        """
        values = np.zeros((1, sum(len(effect.parameters) for effect in effects))) if values is None else values
        scenes = [replace(FREE_DECAY, timestep_s=step_s) for step_s in (self.timestep_s, self.timestep_s / 2)]
        plain = [Twin(twin.robot, twin.markers, scene, twin.workers) for scene in scenes]
        coarse, fine = (self._read(_Released(each, effects, self.start_rad), values) for each in plain)
        return 2 * fine - coarse

    def _read(self, released: "_Released", values: np.ndarray) -> np.ndarray:
        count, own = len(values), [released.markers.index(name) for name in self.trial.markers]
        runs = AffectedRuns(np.zeros((count, _NO_FLUID)), np.zeros(count), np.zeros(count), values=values)
        told = released.simulate(runs, self.trial.time_s, allow_divergence=True)
        return np.array([self._ringing(lateral) for lateral in told.marker_m[:, :, own, 1]]).reshape(-1, NUMBERS)

    def _ringing(self, lateral_m: np.ndarray) -> np.ndarray:
        """(2,) of motions (n, k), seen in the frames in which the markers were."""
        if not np.isfinite(lateral_m).all():
            return np.full(NUMBERS, np.nan)
        natural_hz, rate = float(np.exp(self.measured[0] / 2)), float(np.exp(self.measured[1]))
        guess_hz = float(np.sqrt(max(natural_hz**2 - (rate / (2 * np.pi)) ** 2, (0.1 * natural_hz) ** 2)))
        ring = fit_damped_sine(self.trial.time_s, lateral_m, (self.trial.weight > 0).astype(float), (guess_hz, rate))
        if ring.decay_1_s <= 0:
            return np.full(NUMBERS, np.nan)
        return np.array([2 * np.log(ring.natural_hz), np.log(ring.decay_1_s)])


def shows_in_decays(effect: Effect) -> bool:
    """Whether it changes how a released tail rings."""
    return "free_decay" in effect.seen_in and bool(_MOVES & set(effect.enters()))


def ring_changes(ring: Ring, twin: Twin, effects: Sequence[Effect], values: np.ndarray) -> np.ndarray:
    """(s, 2) by how much effects at values (s, p) change a decay; nan where the twin diverged.

    Only those that can show in one act.
    """
    act = np.repeat([shows_in_decays(effect) for effect in effects], [len(effect.parameters) for effect in effects])
    own = np.where(act.astype(bool), values, 0.0)
    if not own.any():
        return np.zeros((len(values), NUMBERS))
    told = ring.of_twin(twin, effects, np.vstack([np.zeros_like(own[:1]), own]))
    return np.asarray(told[1:] - told[0])


class _Released(AffectedTwin):
    """A twin that is let go in air: each simulation begins in the same pose, with the same rates (2, h)."""

    def __init__(self, twin: Twin, effects: Sequence[Effect], start_rad: np.ndarray) -> None:
        super().__init__(twin, effects)
        self._start_rad = start_rad

    def start(self, runs: Runs) -> tuple[np.ndarray, np.ndarray]:
        """(n, q) positions and (n, v) velocities of the joints at time 0."""
        position, velocity = super().start(runs)
        position[:, self._hinges], velocity[:, self._hinges] = self._start_rad
        return position, velocity
