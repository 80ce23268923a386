"""Model discrepancy, what no effect of the catalogue explains: of a gap of unknown size, and of a twin that is right.

`GaussianProcessDiscrepancy`: how features would differ under a gap of no particular cause. Displacements of a marker
are correlated with those of its neighbours along the body, less so the further they are, and the higher a harmonic is
the smaller they are; each trial has its own. The differences of frequencies from their commands have their own size,
and so have free decays: a clock that is wrong says nothing of how the fish swims.

`Discrepancy`: how a refitted twin differs in features where nothing is wrong, as two simulators of one robot do. It was
measured between the twin and a second simulator over sessions of drawn water (`benchmarks/effects`), for the nine
published markers (`shipped_discrepancy`); for other markers it is taken from the nearest of these along the body, each
by itself (`discrepancy_for`). How straight a fish goes, and whether its markers stay in place, is not among the numbers
that the benchmark compares; the residual of these is `COURSE_SD` and `SLIDE_SD_M_S`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.resources import as_file, files
from importlib.resources.abc import Traversable
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from diagnosis.constants import (
    COURSE_PER_M,
    COURSE_SD,
    CREEP_PER_M,
    HERTZ_PER_M,
    NEAR,
    RING_PER_M,
    SLIDE_PER_M,
    SLIDE_SD_M_S,
    SPEED_PER_M,
)
from fitting.covariance import along_body, harmonic_decay
from fitting.features import COURSE, OF_A_MARKER, SLIDES, SPEED, advance_phase
from fitting.pool import tail_markers
from fitting.session_model import SessionModel
from fitting.signatures import Signature, little
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import Fault, InputError
from swimcal.robot import RobotSpec

# A gap of no particular cause
_SIZES_M = (1e-6, 0.05)  # ends of the sizes tried for features and free decays
_HERTZ_SIZES_M = (1e-6, 1.0)  # ends of the sizes tried for frequencies
_SIZES_TRIED = 60  # sizes on the grid between these ends

# A twin where nothing is wrong
_OF_A_MARKER = 2 * OF_A_MARKER  # numbers of a marker in features: along and across


# A gap of no particular cause.


def generic_covariance(
    along_m: np.ndarray, trials: int, frequencies: int, creeps: int = 0, rings: int = 0
) -> np.ndarray:
    """Return the covariance (k, k) of a gap with displacements of one metre.

    Args:
        along_m: (m,) place of each marker on the straight robot, m.
        trials: number of trials.
        frequencies: number of frequencies.
        creeps: number of speeds at which markers slide aside.
        rings: number of numbers from free decays.
    """
    between, of_beat = along_body(along_m), np.diag(np.append(1.0, harmonic_decay()) ** 2)
    assert len(of_beat) == OF_A_MARKER
    markers = np.kron(between, np.kron(np.eye(2), of_beat))  # (14 m, 14 m)
    assert SPEED == 0
    assert len(COURSE_PER_M) == len(COURSE)
    slides = SLIDE_PER_M**2 * between[:SLIDES, :SLIDES]
    features = block_diag([[SPEED_PER_M**2]], markers, slides, np.diag(np.square(COURSE_PER_M)))
    beside = ((HERTZ_PER_M, frequencies), (CREEP_PER_M, creeps), (RING_PER_M, rings))
    return block_diag(*[features] * trials, *(per_m**2 * np.eye(count) for per_m, count in beside))


@dataclass(frozen=True, eq=False)
class GaussianProcessDiscrepancy:
    """A gap of no particular cause, in addition to what is known of a row.

    Attributes:
        known: (k, k) covariance of what is known.
        generic: (k, k) covariance of a gap of one metre.
        frequencies: number of frequencies behind the features.
        creeps: number of speeds at which markers slide aside, behind these.
        rings: number of numbers from free decays, at the row's end.
    """

    known: np.ndarray
    generic: np.ndarray
    frequencies: int
    creeps: int = 0
    rings: int = 0

    def covariance(self, residual: np.ndarray) -> np.ndarray:
        """Return the covariance (k, k) at the likeliest sizes of features, frequencies, creeps and decays.

        The sizes are those in a residual (k,).
        """
        parts = [
            beside.likeliest_m(residual[own], ends) ** 2 * self.generic[own, own]
            for own, beside, ends in zip(
                self._parts, self._decompositions, (_SIZES_M, _HERTZ_SIZES_M, _SIZES_M, _SIZES_M), strict=True
            )
            if beside is not None
        ]
        return np.asarray(block_diag(*parts))

    @property
    def _parts(self) -> tuple[slice, ...]:
        beside = (self.frequencies, self.creeps, self.rings)
        ends = np.cumsum([0, len(self.generic) - sum(beside), *beside])
        return tuple(slice(*both) for both in pairwise(map(int, ends)))

    @cached_property
    def _decompositions(self) -> "tuple[_KnownAndGeneric | None, ...]":
        squares = ((self.known[own, own], self.generic[own, own]) for own in self._parts)
        return tuple(_KnownAndGeneric.of(known, generic) if len(known) else None for known, generic in squares)


class _KnownAndGeneric(NamedTuple):
    """Root (k, k) of the known covariance, and variances (k,) and directions (k, k) of a whitened gap of one metre."""

    root: np.ndarray
    values: np.ndarray
    vectors: np.ndarray

    @classmethod
    def of(cls, known: np.ndarray, generic: np.ndarray) -> "_KnownAndGeneric":
        """Decompose the covariances (k, k) of what is known and of a gap of one metre."""
        root = np.linalg.cholesky(known)
        white = solve_triangular(root, generic, lower=True)
        values, vectors = np.linalg.eigh(solve_triangular(root, white.T, lower=True))
        return cls(root, np.maximum(values, 0.0), vectors)

    def likeliest_m(self, residual: np.ndarray, ends_m: tuple[float, float]) -> float:
        """Return the likeliest size of the gap in a residual (k,), between these ends."""
        seen = (self.vectors.T @ solve_triangular(self.root, residual, lower=True)) ** 2
        sizes = np.geomspace(*ends_m, _SIZES_TRIED)
        variance = 1 + np.outer(sizes**2, self.values)
        return float(sizes[np.argmin((seen / variance + np.log(variance)).sum(axis=1))])


# The discrepancy of a twin where nothing is wrong.


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

    def over(self, model: SessionModel, alike: np.ndarray | None = None) -> np.ndarray:
        """Return the covariance (k, k) of the residual of a model's features.

        Runs with the head clamped in air have nothing in common with swims. Where features hold the course, each trial
        has its own, and so has each marker of its sliding.

        Args:
            model: the trials.
            alike: (t, t) share that each two trials have in common of what otherwise each has to itself; default none.
        """
        trials = model.trials
        hertz = np.array([each.trial.frequency.hz for each in trials])
        clamped = np.array([each.twin.scene.head_clamped for each in trials])
        count, length, whole = len(trials), len(self.directions), len(trials[0].measured)
        result = np.zeros((count, whole, count, whole))
        of_features = self.of_features(hertz, model.phase_rad, alike).reshape(count, length, count, length)
        result[:, :length, :, :length] = of_features * np.equal.outer(clamped, clamped)[:, None, :, None]
        slides = max(whole - length - len(COURSE_SD), 0)
        course = np.diag(np.square([*(SLIDE_SD_M_S,) * slides, *COURSE_SD]))[: whole - length, : whole - length]
        result[:, length:, :, length:] = np.einsum("ij,ab->iajb", np.eye(count), course)
        return result.reshape(count * whole, -1)

    def of_features(self, hertz: np.ndarray, phase_rad: np.ndarray, alike: np.ndarray | None = None) -> np.ndarray:
        """Return the covariance (t g, t g) of the residual of swims.

        Args:
            hertz: (t,) frequencies of the swims, Hz.
            phase_rad: (t,) phases at which their tails begin.
            alike: as in `over`.
        """
        turned = advance_phase(np.repeat(self.directions.T[:, None], len(hertz), axis=1), phase_rad)  # (q, t, g)
        shared = self.shared(hertz, alike)
        size = turned[0].size
        return np.einsum("qia,ijq,qjb->iajb", turned, shared, turned, optimize=True).reshape(size, size)

    def shared(self, hertz: np.ndarray, alike: np.ndarray | None = None) -> np.ndarray:
        """Return the correlations (t, t, q) between swims at frequencies (t,); (t, t) `alike` as in `over`."""
        everywhere, near = self.common.T
        together = np.eye(len(hertz)) if alike is None else alike
        own = together[:, :, None] * (1 - everywhere - near)
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
    rows = advance_phase(known.directions[np.concatenate([[SPEED], *parts])].T, -ahead).T
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
