"""Straight fish cut into links and strips: what does not differ between simulations of one robot.

Planar vectors are complex numbers throughout the package, x + i y; a link's own axes are x along it, tailwards, and y
across it. Every flexible gap of the tail bends at several hinges, evenly spread over its middle, each stiffer in
proportion, so that the gap as a whole bends as in the robot's description.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from swimcal.robot import RobotSpec

HINGES_PER_GAP = 2
FLEXIBLE_SHARE = 0.4
"""Share of every gap that bends, in its middle; its ends are held stiff by the segments they are glued into.

Bending that is spread over whole gaps would let the pulled tendon fold the second one at once.
"""
_HEAD_STRIPS = 10
_TAIL_STRIP_M = 0.008  # No strip of tail and fin is longer.


@dataclass(frozen=True, eq=False)
class Strips:
    """Wetted surface cut across: keel, tail, caudal fin, from nose to tail."""

    link: np.ndarray  # (s,) index of the link that carries the strip
    plate: np.ndarray  # (s,) index of the rigid plate that it is part of: of one link, and of keel, tail or fin
    place_m: np.ndarray  # (s,) place of its middle, from the link's origin, m
    length_m: np.ndarray  # (s,) length along the link, m
    half_height_m: np.ndarray  # (s,) m
    half_thickness_m: np.ndarray  # (s,) m
    half_chord_m: np.ndarray  # (s,) half the length of the plate that the strip is part of, m


@dataclass(frozen=True, eq=False)
class Layout:
    """Links (l: the head, then one behind every hinge), strips (s) and tendon guides (g) of the straight fish."""

    robot: RobotSpec  # robot that is cut
    hinges_per_gap: int  # hinges that represent one of the robot's
    origin_m: np.ndarray  # (l,) x of each link's origin, the head's at 0, the others' at their hinge, m
    reach_m: np.ndarray  # (l,) distance from each link's origin to the next one's, m; 0 for the last
    # mass_kg, moment_kg_m, inertia_kg_m2: (l,) of each link, moment and inertia about its origin
    mass_kg: np.ndarray
    moment_kg_m: np.ndarray
    inertia_kg_m2: np.ndarray
    strips: Strips  # strips of the surface
    guide_link: np.ndarray  # (g,) link of each pair of tendon guides
    guide_place_m: np.ndarray  # (g,) distance of the guides behind the link's origin, m
    guide_offset_m: np.ndarray  # (2, g) place of either tendon's guide across the link, m

    @property
    def hinges(self) -> int:
        """Number of hinges."""
        return len(self.origin_m) - 1

    @property
    def gap_of_hinge(self) -> np.ndarray:
        """(h,) index of the robot's hinge that each one belongs to."""
        return np.arange(self.hinges) // self.hinges_per_gap

    def on_links(self, link: np.ndarray, kg: np.ndarray, place_m: np.ndarray) -> np.ndarray:
        """Return (3, l) mass, first and second moment of masses that hang on links at places from their origins."""
        added = np.zeros((3, self.hinges + 1))
        for order in range(3):
            np.add.at(added[order], link, kg * place_m**order)
        return added

    def link_of(self, body: str) -> int:
        """Return the index of the link that represents one of the robot's rigid bodies."""
        return self.robot.links.index(body) * self.hinges_per_gap


def lay_out(robot: RobotSpec, hinges_per_gap: int = HINGES_PER_GAP) -> Layout:
    """Cut a robot into links and strips."""
    tail = robot.tail
    gaps = np.array([segment.gap_m for segment in tail.segment])
    spread = FLEXIBLE_SHARE * ((np.arange(hinges_per_gap) + 0.5) / hinges_per_gap - 0.5)
    origin = np.concatenate([[0.0], (robot.hinge_x_m[:, None] + gaps[:, None] * spread).ravel()])
    guide_link = hinges_per_gap * (1 + np.arange(len(gaps)))
    guide_x = robot.segment_x_m[:, 1] - tail.guide_inset_m
    offset = np.array([s.guide_offset_m * (-1 if s.tendon_crosses else 1) for s in tail.segment])
    mass, moment, inertia = _sum_masses(robot, origin)
    return Layout(
        robot=robot,
        hinges_per_gap=hinges_per_gap,
        origin_m=origin,
        reach_m=np.append(np.diff(origin), 0.0),
        mass_kg=mass,
        moment_kg_m=moment,
        inertia_kg_m2=inertia,
        strips=_cut_strips(robot, origin),
        guide_link=guide_link,
        guide_place_m=guide_x - origin[guide_link],
        guide_offset_m=np.stack([-offset, offset]),
    )


def _sum_masses(robot: RobotSpec, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (l,) mass, first and second moment of each link about its origin.

    A segment's mass is spread evenly from the middle of the gap before it to the middle of the one behind, that of a
    flexible strip over its half of a gap.
    """
    tail, fin = robot.tail, robot.caudal_fin
    mass, moment, inertia = np.zeros((3, len(origin)))

    def add(link: int, kg: float, x: float, own: float) -> None:
        mass[link] += kg
        moment[link] += kg * (x - origin[link])
        inertia[link] += own + kg * (x - origin[link]) ** 2

    def spread(kg: float, start: float, end: float, thickness: float) -> None:
        if kg == 0:
            return
        inner = origin[(origin > start) & (origin < end)]
        for a, b in pairwise([start, *inner, end]):
            part_kg = kg * (b - a) / (end - start)
            add(_find_link(origin, (a + b) / 2), part_kg, (a + b) / 2, part_kg * ((b - a) ** 2 + thickness**2) / 12)

    for part in robot.head.part:
        (x, y, _), (half_x, half_y, _) = part.centre_m, part.half_size_m
        add(0, part.mass_kg, x, part.mass_kg * ((half_x**2 + half_y**2) / 3 + y**2))
    ends = np.append(robot.hinge_x_m, robot.fin_root_x_m)
    for i, segment in enumerate(tail.segment):
        spread(robot.segment_mass_kg(i), ends[i], ends[i + 1], segment.thickness_m)
        hinge, half = robot.hinge_x_m[i], segment.gap_m / 2
        spread(segment.strip_mass_kg, hinge, hinge + half, 0.0)
        if i > 0:  # that before the first hinge is a part of the head
            spread(segment.strip_mass_kg, hinge - half, hinge, 0.0)
        (_, rear), width = robot.segment_x_m[i], segment.guide_plate_width_m
        plates_kg, across = 2 * robot.guide_plate_mass_kg(i), (segment.thickness_m + width) / 2
        own = (tail.guide_plate_length_m**2 + width**2) / 12 + across**2
        add(_find_link(origin, rear), plates_kg, rear - tail.guide_inset_m, plates_kg * own)
    spread(fin.strip_mass_kg, robot.segment_x_m[-1, 1], robot.fin_root_x_m, 0.0)
    own = fin.mass_kg * (fin.chord_m**2 + fin.thickness_m**2) / 12
    add(len(origin) - 1, fin.mass_kg, robot.fin_root_x_m + fin.centre_m, own)
    return mass, moment, inertia


def _cut_strips(robot: RobotSpec, origin: np.ndarray) -> Strips:
    """Cut keel and fin as plates of their own; of the tail, each piece between the middles of two gaps."""
    rows: list[tuple[float, ...]] = []
    plates = 0

    def cut(start: float, end: float, longest: float, plate: tuple[float, float, float]) -> None:
        nonlocal plates
        inner = origin[1:][(origin[1:] > start) & (origin[1:] < end)]
        knots = np.concatenate([[start], inner, [end]])
        for low, high in pairwise(knots):
            edges = np.linspace(low, high, max(int(np.ceil((high - low) / longest - 1e-9)), 1) + 1)
            for a, b in pairwise(edges):
                link = _find_link(origin, (a + b) / 2)
                rows.append((link, plates, (a + b) / 2 - origin[link], b - a, *plate))
            plates += 1

    x, (half_x, half_y, half_z) = robot.head.fluid_centre_m[0], robot.head.fluid_half_size_m
    cut(x - half_x, x + half_x, 2 * half_x / _HEAD_STRIPS, (half_z, half_y, half_x))
    ends = np.concatenate([robot.hinge_x_m, [robot.fin_root_x_m]])
    starts = np.concatenate([[robot.tail.start_m], robot.hinge_x_m[1:]])
    for i, segment in enumerate(robot.tail.segment):
        plate = (segment.half_height_m, segment.thickness_m / 2, (ends[i + 1] - ends[i]) / 2)
        cut(starts[i], ends[i + 1], _TAIL_STRIP_M, plate)
    fin, middle = robot.caudal_fin, robot.fin_root_x_m + robot.caudal_fin.centre_m
    plate = (fin.span_m / 2, fin.thickness_m / 2, fin.chord_m / 2)
    cut(middle - fin.chord_m / 2, middle + fin.chord_m / 2, _TAIL_STRIP_M, plate)
    link, number, *columns = np.array(rows).T
    return Strips(link.astype(int), number.astype(int), *columns)


def _find_link(origin: np.ndarray, x: float) -> int:
    """Return the link that holds a place x on the straight fish; whatever is before the first hinge is the head's."""
    return 0 if x < origin[1] else int(np.searchsorted(origin, x, side="right")) - 1
