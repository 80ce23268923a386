"""Something that no catalogue holds, but that acts at one place: a marker, the head, a hinge, the tail, picture, time.

What is amiss at one place is told by few numbers: so it shows where a gap of no particular cause of the same length
would not. It may be the same in all trials, or another in each.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from diagnosis.constants import OF_HARMONIC, OF_WATER, PLACED, SLIDE_PER_M
from diagnosis.ground import Ground
from diagnosis.pushes import HEAD, Responses, across
from diagnosis.ripples import rippled, smeared
from fitting.model.features import (
    HARMONICS,
    OF_A_MARKER,
    SPEED,
    advanced,
    of_markers,
    places_of_markers,
    places_of_slides,
)

_SIDEWAYS = -2  # place of the sideways speed in features with its course
_RIPPLE_RAD, _SMEAR_RAD = 0.02, 0.2  # against each other
STAGE_OF = {
    "marker": "camera",
    "picture": "camera",
    "timing": "drive",
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


def local_discrepancies(ground: Ground, responses: Responses) -> tuple[LocalDiscrepancy, ...]:
    """At every place: a marker seen elsewhere, and forces that are missing, each a mean and harmonics of the beat.

    Also markers and boxes that sit elsewhere, a picture that is drawn out of shape, and beats that come early and late.
    """
    found = []
    dry = (*_at_markers(ground), *_in_hinges(responses), _in_picture(ground), _in_time(ground))
    for weight, places in ((1.0, dry), (OF_WATER, tuple(_by_water(ground, responses)))):
        for place, columns in places:
            within = columns.reshape(len(columns), len(ground.trials), -1)
            found.append(LocalDiscrepancy(place, True, within.sum(axis=1), weight))
            if len(ground.trials) > 1:
                found.append(LocalDiscrepancy(place, False, within.reshape(len(columns), -1)))
    found += _sitting_elsewhere(ground)
    return tuple(found)


def _at_markers(ground: Ground) -> Iterator[tuple[str, np.ndarray]]:
    """(k, t, 15) of each marker: mean and harmonics as the beat goes on, whatever phase a trial begins at; and sliding.

    But for that beyond the eleventh.
    """
    decay = np.append(1.0, np.repeat(OF_HARMONIC ** np.arange(HARMONICS), 2))
    phases = ground.model.phase_rad
    own = len(ground.model.measured) // len(phases)
    slides = np.arange(own)[places_of_slides(own)]
    for number, marker in enumerate(ground.trials[0].markers):
        features = np.zeros((2 * OF_A_MARKER + 1, own))
        features[:-1, SPEED + 1 + 2 * OF_A_MARKER * number :][:, : 2 * OF_A_MARKER] = np.diag(np.tile(decay, 2))
        features[-1, slides[number : number + 1]] = SLIDE_PER_M
        columns = np.zeros((len(ground.left), len(phases), len(features)))
        for trial, phase in enumerate(phases):
            columns[own * trial : own * (trial + 1), trial] = advanced(features, float(phase)).T
        yield f"marker {marker}", columns


def _sitting_elsewhere(ground: Ground) -> Iterator[LocalDiscrepancy]:
    """(k, 2) of each marker that is elsewhere on the body, and of each box beside its marker, alike in all trials.

    Nose and neck take scale and heading with them. Boxes that are alike in all trials are not the ones that were put a
    little off in each.
    """
    disturbed, features, markers = ground.disturbances, len(ground.model.measured), ground.trials[0].markers
    per_box = disturbed.per_box.reshape(features, len(ground.trials), -1).sum(axis=1)
    for moved in (disturbed.per_marker, per_box):
        for number, marker in enumerate(markers):
            columns = np.zeros((len(ground.left), 2))
            columns[:features] = moved[:, 2 * number : 2 * number + 2]
            yield LocalDiscrepancy(f"marker {marker}", True, columns)


def _in_picture(ground: Ground) -> tuple[str, np.ndarray]:
    """(k, t, 4) of a picture that is drawn out along and across the fish, and sheared either way."""
    features = [model.measured for model in ground.model.trials]
    columns = np.zeros((len(ground.left), len(features), 4))
    for trial, one in enumerate(features):
        beats, speeds = of_markers(one), (SPEED, _SIDEWAYS)  # along and across, either
        own = columns[len(one) * trial : len(one) * (trial + 1), trial]
        for number, (to, of) in enumerate(product((0, 1), repeat=2)):
            seen = np.zeros_like(beats)
            seen[:, to] = beats[:, of]
            own[places_of_markers(len(one)), number] = seen.ravel()
            own[speeds[to], number] = one[speeds[of]]
        slides = places_of_slides(len(one))
        own[slides, 0] = one[slides]  # along; across they are not told
    return "picture", columns


def _in_time(ground: Ground) -> tuple[str, np.ndarray]:
    """(k, t, 5) of beats that come early and late, in step with the crank or not."""
    features = [model.measured for model in ground.model.trials]
    within = [np.column_stack([_SMEAR_RAD**2 * smeared(one), _RIPPLE_RAD * rippled(one)]) for one in features]
    columns = np.zeros((len(ground.left), len(features), within[0].shape[1]))
    for trial, own in enumerate(within):
        columns[len(own) * trial : len(own) * (trial + 1), trial] = own
    return "timing of the beat", columns


def _in_hinges(responses: Responses) -> Iterator[tuple[str, np.ndarray]]:
    """(k, t, 7) of a torque in each hinge, and of one that is alike in all."""
    for number, hinge in enumerate(responses.joints[len(HEAD) :], len(HEAD)):
        yield f"hinge {hinge}", responses.columns[:, :, number]
    if len(responses.joints) > len(HEAD) + 1:
        yield "whole tail", responses.columns[:, :, len(HEAD) :].sum(axis=2)


def _by_water(ground: Ground, responses: Responses) -> Iterator[tuple[str, np.ndarray]]:
    """(k, t, b) of forces on the head, and of a force across the tail at each marker on it."""
    of_head = responses.columns[:, :, : len(HEAD)]
    yield "head, steadily", of_head[..., 0]
    yield "head", of_head.reshape(*of_head.shape[:2], -1)
    over_unit = responses.columns / responses.unit[:, None]
    robot, markers = ground.twin.robot, ground.trials[0].markers
    for marker, place_m in zip(markers, robot.marker_positions_m(markers)[:, 0], strict=True):
        if place_m > robot.hinge_x_m[0]:
            on_joints = across(float(place_m), robot.hinge_x_m)
            yield f"tail at {marker}", np.einsum("ktjn,j->ktn", over_unit, on_joints)
