"""Localised discrepancies: forces missing on the head and in every hinge, and an unknown effect at one place.

`responses` gives what each force alone changes, linear about the twin; `local_discrepancies` lists the places where an
unknown effect may act. A fault at one place (at a marker, on the head, in a hinge, across the tail) takes few numbers:
so it shows where a gap of no particular cause of the same norm would not. It may be the same in all trials, or another
in each.
"""

from collections.abc import Iterator, Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from diagnosis.constants import CREEP_PER_M, OF_WATER, PLACED, SLIDE_PER_M
from diagnosis.linear_model import LinearModel
from fitting.covariance import harmonic_decay
from fitting.features import OF_A_MARKER, SPEED, advance_phase, places_of_slides
from fitting.pool import waves
from fitting.signatures import signature_of
from fitting.trial import HARMONICS
from swimcal.effects.effect import Effect, Parameter, StepForce, StepState
from swimcal.mjcf import Scene
from swimcal.robot import RobotSpec
from swimcal.session_file import TrialKind

HEAD = ("head_along", "head_across", "head_moment")  # forces and the moment on the head
PER_JOINT = 1 + 2 * HARMONICS  # numbers of a force: mean, then cosine and sine of each harmonic
# Responses are measured with these forces on the head, moment on it and torques in the hinges.
FORCE_N = 0.02
MOMENT_N_M = 0.004
TORQUE_N_M = 0.004
STAGE_OF = {
    "marker": "camera",
    "hinge": "tail",
    "whole": "tail",
    "tail": "body",
    "head": "body",
}
"""Stage of a place, by its first word; drag on the tail belongs to the body, as in the catalogue's effects."""


class GeneralisedForces(Effect):
    """Forces along and across the head (N), a moment on it and torques in the hinges (N m).

    Each has a mean and harmonics of the crank angle. No catalogue holds this effect: it represents whatever is missing.
    """

    name = "generalised_forces"
    family = "fluid"
    stage = "body"
    physics = "Generalised forces that are periodic with the crank."
    source = "Inverse dynamics, linear about the twin."
    seen_in: ClassVar[frozenset[TrialKind]] = frozenset({"swim", "dry"})

    def __init__(self, robot: RobotSpec) -> None:
        self.joints = (*HEAD, *robot.hinges)
        sd = dict.fromkeys(HEAD[:2], FORCE_N) | {HEAD[2]: MOMENT_N_M}
        self.parameters = tuple(
            Parameter(f"{joint}_{number}", "N" if joint in HEAD[:2] else "N m", -1.0, 1.0, sd.get(joint, TORQUE_N_M))
            for joint in self.joints
            for number in range(PER_JOINT)
        )

    @property
    def sd(self) -> np.ndarray:
        """Standard deviations (p,) with which responses are measured."""
        return np.array([parameter.sd for parameter in self.parameters])

    def force(self, robot: RobotSpec, scene: Scene, values: np.ndarray) -> StepForce | None:  # noqa: ARG002
        """Return the forces, on all joints but the crank."""
        if not values.any():
            return None
        amplitudes = values.reshape(len(values), len(self.joints), PER_JOINT)
        free = 0 if scene.head_clamped else len(HEAD)

        def force(state: StepState) -> np.ndarray:
            crank = state.position[:, free]
            columns = np.column_stack([np.ones(len(crank)), waves(crank, HARMONICS)])
            amount = np.einsum("njc,nc->nj", amplitudes, columns)
            result = np.zeros_like(state.velocity)
            if free:
                cos, sin = np.cos(state.position[:, 2]), np.sin(state.position[:, 2])
                result[:, 0] = cos * amount[:, 0] - sin * amount[:, 1]
                result[:, 1] = sin * amount[:, 0] + cos * amount[:, 1]
                result[:, 2] = amount[:, 2]
            result[:, free + 1 :] = amount[:, len(HEAD) :]
            return result

        return force


class ForceResponses(NamedTuple):
    """Columns (k, t, j, 7) of the row, for one standard force (j,), N or N m, on a joint in one trial alone."""

    joints: tuple[str, ...]
    columns: np.ndarray
    unit: np.ndarray


def responses(linear: LinearModel) -> ForceResponses:
    """Return the response to each force alone, linear about the twin."""
    pushes = GeneralisedForces(linear.twin.robot)
    rows = signature_of(pushes, linear.model, linear.camera, linear.at, np.diag(pushes.sd)).rows  # (p, k)
    rows = np.nan_to_num(rows)
    trials, length = len(linear.trials), rows.shape[1]
    own = len(linear.model.measured) // trials
    columns = np.zeros((length, trials, len(rows)))
    for trial in range(trials):
        part = slice(own * trial, own * (trial + 1))
        columns[part, trial] = rows[:, part].T
    unit = pushes.sd.reshape(len(pushes.joints), PER_JOINT)[:, 0]
    return ForceResponses(pushes.joints, columns.reshape(length, trials, len(unit), PER_JOINT), unit)


def across(place_m: float, hinge_m: np.ndarray) -> np.ndarray:
    """Return the generalised forces (3 + h,), N and N m, of 1 N to the left at one place of the straight robot.

    Args:
        place_m: x of the place, m.
        hinge_m: (h,) x of the hinges, m.
    """
    return np.concatenate([[0.0, 1.0, place_m], np.maximum(place_m - hinge_m, 0.0)])


class LocalDiscrepancy(NamedTuple):
    """An unknown effect at one place.

    Attributes:
        place: name of the place.
        same: whether it is the same in all trials.
        columns: (k, b) columns of the row.
        weight: prior weight of the place against others.
    """

    place: str
    same: bool
    columns: np.ndarray
    weight: float = 1.0

    @property
    def stage(self) -> str:
        """Stage at which the effect makes a gap."""
        return STAGE_OF[self.place.split()[0].rstrip(",")]


def likely_of(sought: Sequence[LocalDiscrepancy], at_place: Sequence[float]) -> tuple[LocalDiscrepancy, ...]:
    """Return the likeliest effect at each place that probably has one.

    Args:
        sought: the effects at all places.
        at_place: probability of each.
    """
    whole: dict[str, float] = {}
    best: dict[str, tuple[float, LocalDiscrepancy]] = {}
    for each, chance in zip(sought, at_place, strict=True):
        whole[each.place] = whole.get(each.place, 0.0) + chance
        if each.place not in best or chance > best[each.place][0]:
            best[each.place] = chance, each
    return tuple(best[place][1] for place, chance in whole.items() if chance >= PLACED)


def local_discrepancies(linear: LinearModel, responses: ForceResponses) -> tuple[LocalDiscrepancy, ...]:
    """List the unknown effects at every place: displaced markers, and missing forces.

    Each has a mean and harmonics of the beat.
    """
    found = []
    dry = (*_at_markers(linear), *_in_hinges(responses))
    for weight, places in ((1.0, dry), (OF_WATER, tuple(_by_water(linear, responses)))):
        for place, columns in places:
            within = columns.reshape(len(columns), len(linear.trials), -1)
            found.append(LocalDiscrepancy(place, True, within.sum(axis=1), weight))
            if len(linear.trials) > 1:
                found.append(LocalDiscrepancy(place, False, within.reshape(len(columns), -1)))
    return tuple(found)


def _at_markers(linear: LinearModel) -> Iterator[tuple[str, np.ndarray]]:
    """Yield columns (k, t, 16) of each marker: mean and harmonics, whatever phase a trial begins at, and sliding.

    It slides along and aside; along only up to the eleventh marker.
    """
    decay = np.append(1.0, harmonic_decay())
    phases = linear.model.phase_rad
    own = len(linear.model.measured) // len(phases)
    slides = np.arange(own)[places_of_slides(own)]
    for number, marker in enumerate(linear.trials[0].markers):
        features = np.zeros((2 * OF_A_MARKER + 1, own))
        features[:-1, SPEED + 1 + 2 * OF_A_MARKER * number :][:, : 2 * OF_A_MARKER] = np.diag(np.tile(decay, 2))
        features[-1, slides[number : number + 1]] = SLIDE_PER_M
        columns = np.zeros((len(linear.residual), len(phases), len(features) + 1))
        for trial, (model, phase) in enumerate(zip(linear.model.trials, phases, strict=True)):
            columns[own * trial : own * (trial + 1), trial, :-1] = advance_phase(features, float(phase)).T
            aside = model.reader.against_neighbours(model.along_m)[:, number]
            first = linear.model.places_of_creeps.start + len(aside) * trial
            columns[first : first + len(aside), trial, -1] = CREEP_PER_M * aside
        yield f"marker {marker}", columns


def _in_hinges(responses: ForceResponses) -> Iterator[tuple[str, np.ndarray]]:
    """Yield columns (k, t, 7) of a torque in each hinge, and of one that is the same in all."""
    for number, hinge in enumerate(responses.joints[len(HEAD) :], len(HEAD)):
        yield f"hinge {hinge}", responses.columns[:, :, number]
    if len(responses.joints) > len(HEAD) + 1:
        yield "whole tail", responses.columns[:, :, len(HEAD) :].sum(axis=2)


def _by_water(linear: LinearModel, responses: ForceResponses) -> Iterator[tuple[str, np.ndarray]]:
    """Yield columns (k, t, b) of forces on the head, and of a force across the tail at each marker on it."""
    of_head = responses.columns[:, :, : len(HEAD)]
    yield "head, steadily", of_head[..., 0]
    yield "head", of_head.reshape(*of_head.shape[:2], -1)
    over_unit = responses.columns / responses.unit[:, None]
    robot, markers = linear.twin.robot, linear.trials[0].markers
    for marker, place_m in zip(markers, robot.marker_positions_m(markers)[:, 0], strict=True):
        if place_m > robot.hinge_x_m[0]:
            on_joints = across(float(place_m), robot.hinge_x_m)
            yield f"tail at {marker}", np.einsum("ktjn,j->ktn", over_unit, on_joints)
