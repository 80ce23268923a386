"""Discrepancy of a refitted twin where nothing is wrong: how two simulators of one robot differ in features.

Measured between the twin and a second simulator over sessions of drawn water (`benchmarks/effects`), for the nine
published markers; for other markers it is taken from the nearest of these along the body, each by itself. How straight
a fish goes, and whether its markers stay in place, is not among the numbers that the benchmark compares; the residual
of these is `COURSE_SD` and `SLIDE_SD_M_S`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import as_file, files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np

from diagnosis.constants import COURSE_SD, NEAR, SLIDE_SD_M_S
from fitting.in_pool import tail_markers
from fitting.model.features import OF_A_MARKER, SPEED, advanced
from fitting.model.session_model import SessionModel
from fitting.signatures import Signature
from fitting.signatures.signature import little
from session import InputError
from session.create import FISHSIM_MARKERS
from session.errors import Fault
from swimmer import RobotSpec

_OF_A_MARKER = 2 * OF_A_MARKER


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Discrepancy of a typical session: of each swim, common to similar swims, and a little of some effects.

    Attributes:
        directions: (g, q) in which the residual of one swim's features is independent, by standard deviations, m and
            m/s; at the phase at which the tail is farthest left.
        common: (q, 2) share of each direction's variance that all swims of a session have in common, and share that
            those at similar frequencies have in common besides; the rest each has to itself.
        strengths: by name of an effect, the standard deviation of each of its parameters, relative to that of its
            prior: the same in all trials of a session.
        beat: (9,) complex, how the published markers beat sideways at that phase, m: for other markers the tail is
            farthest left at another phase.
        heavy: by name of an effect that is far stronger in a few sessions, how many times as strong it is, and in what
            share of the sessions.
    """

    directions: np.ndarray
    common: np.ndarray
    strengths: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    beat: np.ndarray = field(default_factory=lambda: np.zeros(len(FISHSIM_MARKERS), complex))
    heavy: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @classmethod
    def independent(cls, covariance: np.ndarray) -> "Discrepancy":
        """Build a discrepancy in which no two swims have anything in common.

        Args:
            covariance: (g, g) of the residual of each swim, at the phase of `directions`.
        """
        return cls(np.linalg.cholesky(covariance), np.zeros((len(covariance), 2)))

    @classmethod
    def load(cls, path: Path) -> "Discrepancy":
        """Load a discrepancy that was saved.

        Raises:
            InputError: it was saved by a program that did not know what swims have in common.
        """
        with np.load(path) as stands:
            if "directions" not in stands:
                found, expected = ", ".join(stands.files), "directions, common, effects, strengths, beat, seeds"
                step = "Make its suite anew: beside another discrepancy the severities of its effects are others."
                raise InputError([Fault(str(path), "", "not a discrepancy of today", found, expected, (), step)])
            names, strengths = stands["effects"], stands["strengths"]
            by_name = {str(name): tuple(map(float, strengths[names == name])) for name in dict.fromkeys(names)}
            directions, common = (np.asarray(stands[part], float) for part in ("directions", "common"))
            tails = zip(stands["heavy"], stands["heavy_tails"], strict=True) if "heavy" in stands else ()
            heavy = {str(name): (float(times), float(share)) for name, (times, share) in tails}
            return cls(directions, common, by_name, stands["beat"], heavy)

    def over(self, model: SessionModel) -> np.ndarray:
        """Return the covariance (k, k) of the residual of a model's features.

        Runs with the head clamped in air have nothing in common with swims. Where features hold the course, each trial
        has its own, and so has each marker of its sliding.
        """
        trials = model.trials
        hertz = np.array([each.trial.frequency.hz for each in trials])
        clamped = np.array([each.twin.scene.head_clamped for each in trials])
        count, length, whole = len(trials), len(self.directions), len(trials[0].measured)
        result = np.zeros((count, whole, count, whole))
        of_features = self.of_features(hertz, model.phase_rad).reshape(count, length, count, length)
        result[:, :length, :, :length] = of_features * np.equal.outer(clamped, clamped)[:, None, :, None]
        slides = max(whole - length - len(COURSE_SD), 0)
        course = np.diag(np.square([*(SLIDE_SD_M_S,) * slides, *COURSE_SD]))[: whole - length, : whole - length]
        result[:, length:, :, length:] = np.einsum("ij,ab->iajb", np.eye(count), course)
        return result.reshape(count * whole, -1)

    def of_features(self, hertz: np.ndarray, phase_rad: np.ndarray) -> np.ndarray:
        """Return the covariance (t g, t g) of the residual of swims.

        Args:
            hertz: (t,) frequencies of the swims, Hz.
            phase_rad: (t,) phases at which their tails begin.
        """
        turned = advanced(np.repeat(self.directions.T[:, None], len(hertz), axis=1), phase_rad)  # (q, t, g)
        shared = self.shared(hertz)
        size = turned[0].size
        return np.einsum("qia,ijq,qjb->iajb", turned, shared, turned, optimize=True).reshape(size, size)

    def shared(self, hertz: np.ndarray) -> np.ndarray:
        """Return the correlations (t, t, q) between swims at frequencies (t,)."""
        everywhere, near = self.common.T
        own = np.eye(len(hertz))[:, :, None] * (1 - everywhere - near)
        return everywhere + nearness(hertz)[:, :, None] * near + own

    def common_columns(self, signatures: Iterable[Signature]) -> np.ndarray:
        """Return columns (k, c) of the effects of unit strength: what one standard deviation of each parameter does."""
        columns = []
        for signature in signatures:
            times, share = self.heavy.get(signature.effect.name, (1.0, 0.0))
            more = float(np.sqrt(1 + share * (times**2 - 1)))  # root mean square over all sessions
            for number, usual in enumerate(self.strengths.get(signature.effect.name, ())):
                slope = little(signature, number)
                if slope is not None and usual > 0:
                    columns.append(more * usual * signature.effect.parameters[number].sd * slope)
        return np.column_stack(columns) if columns else np.zeros((1, 0))


def nearness(hertz: np.ndarray) -> np.ndarray:
    """Return how much of what swims at similar frequencies (t,) share is common to each two of them, (t, t)."""
    return np.exp(-0.5 * (np.subtract.outer(np.log(hertz), np.log(hertz)) / NEAR) ** 2)


def shipped_discrepancy() -> Traversable:
    """Return the file that every diagnosis uses, with features of the published markers."""
    return files("diagnosis").joinpath("discrepancy.npz")


def discrepancy_for(markers: tuple[str, ...], robot: RobotSpec) -> Discrepancy:
    """Return the discrepancy of features of these markers, without their course."""
    with as_file(shipped_discrepancy()) as path:
        known = Discrepancy.load(path)
    return known if markers == FISHSIM_MARKERS else _of_markers(known, markers, robot)


def _of_markers(known: Discrepancy, markers: tuple[str, ...], robot: RobotSpec) -> Discrepancy:
    """Transfer the discrepancy to other markers.

    Published ones keep their common directions, each other has its own.
    """
    published = [name for name in FISHSIM_MARKERS if name in robot.markers]
    along_m = robot.marker_positions_m(markers)[:, 0]
    if published:
        of_known = robot.marker_positions_m(tuple(published))[:, 0]
        near = [published[int(np.argmin(np.abs(of_known - x)))] for x in along_m]
        near = [own if own in published else other for own, other in zip(markers, near, strict=True)]
        nearest = [FISHSIM_MARKERS.index(name) for name in near]
    else:
        nearest = [round(i) for i in np.linspace(0, len(FISHSIM_MARKERS) - 1, len(markers))]
    parts = [np.arange(1 + _OF_A_MARKER * i, 1 + _OF_A_MARKER * (i + 1)) for i in nearest]
    ahead = float(np.angle(known.beat[[nearest[i] for i in tail_markers(robot, markers)]].sum()))
    rows = advanced(known.directions[np.concatenate([[SPEED], *parts])].T, -ahead).T
    whose = np.concatenate([[-1], np.repeat(np.arange(len(markers)), _OF_A_MARKER)])
    strange = [i for i, name in enumerate(markers) if name not in published]
    together = np.where(np.isin(whose, strange)[:, None], 0.0, rows)
    apart = [_of_one(rows, known.common, np.flatnonzero(whose == i)) for i in strange]
    directions = np.hstack([together, *(each for each, _ in apart)])
    return replace(known, directions=directions, common=np.vstack([known.common, *(each for _, each in apart)]))


def _of_one(rows: np.ndarray, common: np.ndarray, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return directions (g, 3 r) with the covariances of r rows alone, and the common shares in them (3 r, 2)."""
    everywhere, near = common.T
    result = np.zeros((len(rows), 3 * len(own)))
    for kind, share in enumerate((1 - everywhere - near, everywhere, near)):
        variances, vectors = np.linalg.eigh((rows[own] * share) @ rows[own].T)
        result[own, kind * len(own) : (kind + 1) * len(own)] = vectors * np.sqrt(np.maximum(variances, 0.0))
    return result, np.repeat(np.eye(3)[:, 1:], len(own), axis=0)
