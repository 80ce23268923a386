"""An unknown effect that acts at one place: at a marker, on the head, in a hinge, across the tail.

What is amiss at one place takes few numbers: so it shows where a gap of no particular cause of the same length
would not. It may be the same in all trials, or another in each.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.constants import OF_HARMONIC, OF_WATER, PLACED, SLIDE_PER_M
from diagnosis.generalised_forces import HEAD, ForceResponses, across
from diagnosis.linear_model import LinearModel
from fitting.model.features import (
    HARMONICS,
    OF_A_MARKER,
    SPEED,
    advanced,
    places_of_slides,
)

STAGE_OF = {
    "marker": "camera",
    "hinge": "tail",
    "whole": "tail",
    "tail": "body",
    "head": "body",
}
"""Of a place, by its first word; what drags on the tail from outside is the body's, as of effects of the catalogue."""


class LocalDiscrepancy(NamedTuple):
    """What anything at one place would do.

    Attributes:
        place: where.
        same: whether it is the same in all trials.
        columns: (k, b) of the row.
        weight: how likely it is, against others, before a session is looked at.
    """

    place: str
    same: bool
    columns: np.ndarray
    weight: float = 1.0

    @property
    def stage(self) -> str:
        """At which it makes a gap."""
        return STAGE_OF[self.place.split()[0].rstrip(",")]


def likely_of(sought: Sequence[LocalDiscrepancy], at_place: Sequence[float]) -> tuple[LocalDiscrepancy, ...]:
    """At each place where there probably is one, the likeliest.

    Args:
        sought: that were looked for.
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
    """At every place: a marker seen elsewhere, and forces that are missing, each a mean and harmonics of the beat."""
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
    """(k, t, 15) of each marker: mean and harmonics as the beat goes on, whatever phase a trial begins at; and sliding.

    But for that beyond the eleventh.
    """
    decay = np.append(1.0, np.repeat(OF_HARMONIC ** np.arange(HARMONICS), 2))
    phases = linear.model.phase_rad
    own = len(linear.model.measured) // len(phases)
    slides = np.arange(own)[places_of_slides(own)]
    for number, marker in enumerate(linear.trials[0].markers):
        features = np.zeros((2 * OF_A_MARKER + 1, own))
        features[:-1, SPEED + 1 + 2 * OF_A_MARKER * number :][:, : 2 * OF_A_MARKER] = np.diag(np.tile(decay, 2))
        features[-1, slides[number : number + 1]] = SLIDE_PER_M
        columns = np.zeros((len(linear.residual), len(phases), len(features)))
        for trial, phase in enumerate(phases):
            columns[own * trial : own * (trial + 1), trial] = advanced(features, float(phase)).T
        yield f"marker {marker}", columns


def _in_hinges(responses: ForceResponses) -> Iterator[tuple[str, np.ndarray]]:
    """(k, t, 7) of a torque in each hinge, and of one that is alike in all."""
    for number, hinge in enumerate(responses.joints[len(HEAD) :], len(HEAD)):
        yield f"hinge {hinge}", responses.columns[:, :, number]
    if len(responses.joints) > len(HEAD) + 1:
        yield "whole tail", responses.columns[:, :, len(HEAD) :].sum(axis=2)


def _by_water(linear: LinearModel, responses: ForceResponses) -> Iterator[tuple[str, np.ndarray]]:
    """(k, t, b) of forces on the head, and of a force across the tail at each marker on it."""
    of_head = responses.columns[:, :, : len(HEAD)]
    yield "head, steadily", of_head[..., 0]
    yield "head", of_head.reshape(*of_head.shape[:2], -1)
    over_unit = responses.columns / responses.unit[:, None]
    robot, markers = linear.twin.robot, linear.trials[0].markers
    for marker, place_m in zip(markers, robot.marker_positions_m(markers)[:, 0], strict=True):
        if place_m > robot.hinge_x_m[0]:
            on_joints = across(float(place_m), robot.hinge_x_m)
            yield f"tail at {marker}", np.einsum("ktjn,j->ktn", over_unit, on_joints)
