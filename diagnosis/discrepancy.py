"""What a refitted twin leaves of gaits where nothing is wrong: how two simulators of one robot differ.

Measured between the twin and a second simulator over sessions of drawn water (`calib benchmark effects`), for the nine
published markers; of other markers it is taken to be as of the nearest of these along the body, each by itself. How
straight a fish goes is not among the numbers that the benchmark compares; what it leaves of that is `COURSE_SD`.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import as_file, files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag

from fitting.posterior.gait import OF_A_MARKER, SPEED
from fitting.signatures import Signature
from fitting.signatures.slopes import little
from session import FISHSIM_MARKERS
from swimmer import RobotSpec

_OF_A_MARKER = 2 * OF_A_MARKER
COURSE_SD = (0.001, 0.001)
"""Of the speed sideways, m/s, and of the rate of turning, rad/s, where nothing is wrong."""


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Of a session like most: each trial by itself, and a little of some effects, alike in all trials of a session.

    Attributes:
        covariance: (g, g) of what is left of one gait.
        strengths: by name of an effect, the standard deviation of each of its parameters, in those of their priors.
    """

    covariance: np.ndarray
    strengths: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @classmethod
    def load(cls, path: Path) -> "Discrepancy":
        """As it was saved."""
        with np.load(path) as stands:
            names, strengths = stands["effects"], stands["strengths"]
            by_name = {str(name): tuple(map(float, strengths[names == name])) for name in dict.fromkeys(names)}
            return cls(np.asarray(stands["covariance"], float), by_name)

    def save(self, path: Path, seeds: Sequence[int]) -> None:
        """Writes it with the seeds of the sessions that it was found from."""
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(
            path,
            covariance=self.covariance.astype(np.float32),
            effects=np.array([name for name, own in self.strengths.items() for _ in own], dtype=np.str_),
            strengths=np.array([strength for own in self.strengths.values() for strength in own], dtype=float),
            seeds=np.array(seeds),
        )

    def alike(self, signatures: Iterable[Signature]) -> np.ndarray:
        """(k, c) columns of unit strength: what one standard deviation of each parameter of these effects does."""
        columns = []
        for signature in signatures:
            for number, strength in enumerate(self.strengths.get(signature.effect.name, ())):
                slope = little(signature, number)
                if slope is not None and strength > 0:
                    columns.append(strength * signature.effect.parameters[number].sd * slope)
        return np.column_stack(columns) if columns else np.zeros((1, 0))


def with_course(covariance: np.ndarray) -> np.ndarray:
    """(g + 2, g + 2) the covariance (g, g) of one gait, its course with it."""
    return np.asarray(block_diag(covariance, np.diag(np.square(COURSE_SD))))


def shipped_discrepancy() -> Traversable:
    """The file that every diagnosis uses, of gaits of the published markers."""
    return files("diagnosis").joinpath("discrepancy.npz")


def discrepancy_for(markers: tuple[str, ...], robot: RobotSpec) -> Discrepancy:
    """Of gaits of these markers, without their course."""
    with as_file(shipped_discrepancy()) as path:
        known = Discrepancy.load(path)
    return known if markers == FISHSIM_MARKERS else replace(known, covariance=_of_markers(known, markers, robot))


def _of_markers(known: Discrepancy, markers: tuple[str, ...], robot: RobotSpec) -> np.ndarray:
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
    wanted = np.concatenate([[SPEED], *parts])
    own = np.concatenate([[-1], np.repeat(np.arange(len(markers)), _OF_A_MARKER)])
    same = np.array([markers[i] in published for i in range(len(markers))])
    alone = (own[:, None] != own) & ~(same[own][:, None] & same[own] & (own[:, None] >= 0) & (own >= 0))
    alone &= ~((own[:, None] == -1) & same[own]) & ~((own == -1) & same[own][:, None])
    result = known.covariance[np.ix_(wanted, wanted)]
    result[alone] = 0.0
    return np.asarray(result)
