"""Start boxes found in a picture or clicked by a person, and those that may hold no marker.

`find_boxes` finds them without a click, or reports why they are not certain. `click_page` renders a page on which a
person clicks the markers: one file that asks for nothing from the network.

`check_markers` and `check_box` refuse boxes in which nothing stands out. `doubtful_boxes` flags those in which no more
stands out than on the water elsewhere, or something unlike all other markers.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files

import cv2
import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from scipy.special import softmax

from swimcal.errors import Fault, InputError
from swimcal.flags import Flag
from tracking.appearance import (
    FEWEST_ALIKE,
    Appearance,
    Grey,
    lies_within,
    measure_appearance,
    ring_holes_px,
    ring_radii,
    window,
)
from tracking.body_chain import Blob, Bodies, Polarity, body_steps, complete_bodies, find_blobs
from tracking.boxes import Box, StartBoxes
from tracking.sighting import Sighting
from tracking.spots import strongest_answer
from tracking.start_look import move_onto_dots
from tracking.tracked import INDISTINCT
from tracking.tracker import MarkerTracker
from tracking.video import Frame

# The search.
CERTAIN = 0.95
"""Least probability of the body that was found."""
NO_BODY_COST = 1.75
"""Cost for each marker if there is no whole body. The public tracks' own places cost 0.3 to 1.2 a marker; a glint that
stands in for a hidden marker made it 1.7 and more in drawn scenes."""
BOX_DIAMETERS = 1.4
"""Side of a box in diameters of its marker."""
SMALLEST_BOX_PX = 9.0
LONGER = 1.12
"""A marker longer than wide by this factor more than those before and behind it runs into what is next to it."""


# The page to click.
JPEG_QUALITY = 92
USUAL_SIDE_PX = 25.0

PLACES = 400
"""Places of the picture, drawn at random, that a box is compared with."""
FEWEST = 100
"""In a picture full of boxes, with fewer of them, nothing is reported."""
COMMON = 0.01
"""Share of the places that may answer as strongly as a marker does. In rendered pools with ripple and glints no marker
had one such place, markers as bright as the water up to 4 %; of 864 boxes put on the water, 10 had 1 % or less.
"""
PAINT = "paint them white on a dark body, black or red on a bright one, all in one colour"
FAINTER = 0.7
"""Where a few markers look alike, one of the other kind is doubted if its contrast is below this share of theirs."""
CLEAR = 1.5
"""Boxes' sides from any box within which nothing is compared."""
LEAST_CONTRAST = 6.0
"""Steps of brightness by which a marker must stand out in its start box."""
WIDER, CLEARER = 3.0, 2.0
"""Sides of a box that may lie within its marker, and least contrasts by which what is around it then stands out."""
LEAST_CONTRAST_FAINT = 25.0
"""The same where the detector hardly answers, so that only CSRT can follow it."""


def find_boxes(
    luma: np.ndarray,
    layout_m: np.ndarray,
    markers: Sequence[str],
    *,
    frame: int = 0,
    file: str = "the video",
    again: bool = False,
) -> StartBoxes:
    """Find the markers of a straight or bent robot, seen from above, of unknown place, heading and scale.

    Args:
        luma: (h, w) bytes.
        layout_m: (m, 2) marker positions on the straight robot, robot frame, m.
        markers: their m names.
        frame: number of the picture in its video.
        file: name of the video in messages.
        again: they were measured in other frames, so that a marker may run into something next to it.

    Raises:
        InputError: the body is not found, or not with certainty; reports what was seen and how to click it.
    """
    layout_m = np.asarray(layout_m, dtype=float)
    try:
        body_steps(layout_m)
    except ValueError as error:
        raise _refusal(file, frame, "the markers cannot be found", str(error), "") from error
    seen = []
    for polarity in ("bright", "dark"):
        blobs = find_blobs(luma, polarity)
        seen.append(_PolarityBlobs(polarity, blobs, complete_bodies(blobs, layout_m)))
    best = min(seen, key=lambda each: each.bodies.cost[:1].min(initial=np.inf))
    confidence, runner_up = _probabilities(seen, len(markers))
    if confidence < CERTAIN:
        raise _not_certain(file, frame, seen, markers, (confidence, runner_up))
    chosen = [best.blobs[k] for k in best.bodies.blobs[0]]
    if (merged := _find_merged(chosen, layout_m)) and not again:
        found = f"{', '.join(markers[k] for k in merged)} longer than wide, other than the markers before and behind"
        raise _refusal(file, frame, "a marker runs into something next to it", found, "a disc, set off all around")
    boxes = {name: _box(blob, chosen, luma.shape) for name, blob in zip(markers, chosen, strict=True)}
    return StartBoxes(frame, boxes)


@dataclass(frozen=True)
class _PolarityBlobs:
    polarity: Polarity
    blobs: tuple[Blob, ...]
    bodies: Bodies


def _probabilities(seen: Sequence[_PolarityBlobs], count: int) -> tuple[float, float]:
    """Return the probabilities of the best and the next best body, among all bodies and none."""
    costs = np.sort(np.concatenate([each.bodies.cost for each in seen]))
    if len(costs) == 0:
        return 0.0, 0.0
    share = softmax(np.append(-costs, -NO_BODY_COST * count))
    return float(share[0]), float(share[1]) if len(costs) > 1 else 0.0


def _find_merged(chosen: Sequence[Blob], layout_m: np.ndarray) -> list[int]:
    """List the markers whose blob is much longer than its neighbours'.

    Motion blur grows gradually along the body, so such a blob is merged with something else.
    """
    nose, neck, steps = body_steps(layout_m)
    pairs = [(nose, neck), *((step.before, step.marker) for step in steps)]
    longest = np.zeros(len(chosen))  # elongation of each marker's longest neighbour
    for one, other in pairs:
        longest[one] = max(longest[one], chosen[other].elongation)
        longest[other] = max(longest[other], chosen[one].elongation)
    return [k for k, blob in enumerate(chosen) if blob.elongation > LONGER * longest[k]]


def _box(blob: Blob, chosen: Sequence[Blob], shape: tuple[int, ...]) -> Box:
    """Return a square around a marker that ends at the middle of its neighbours and at the edge of the picture."""
    apart = [np.hypot(blob.x - other.x, blob.y - other.y) for other in chosen if other is not blob]
    side = float(np.clip(BOX_DIAMETERS * blob.diameter_px, SMALLEST_BOX_PX, max(min(apart), SMALLEST_BOX_PX)))
    room = 2 * min(blob.x, blob.y, shape[1] - 1 - blob.x, shape[0] - 1 - blob.y) + 1
    return Box.around((blob.x, blob.y), min(side, room))


def _not_certain(
    file: str, frame: int, seen: Sequence[_PolarityBlobs], markers: Sequence[str], sure: tuple[float, float]
) -> InputError:
    counts = " and ".join(f"{len(each.blobs)} {each.polarity} blobs" for each in seen)
    if not any(len(each.bodies.cost) for each in seen):
        return _refusal(file, frame, "the robot was not found", counts, _describe_wanted(markers))
    what = "the robot was not found with certainty"
    if sure[1] > 0.02:
        found = f"{counts}; two ways to see the robot in them, with probabilities {sure[0]:.2f} and {sure[1]:.2f}"
    else:
        found = f"{counts}; the best way to see the robot in them has a probability of {sure[0]:.2f}"
    return _refusal(file, frame, what, found, f"{_describe_wanted(markers)}, and a probability of at least {CERTAIN:g}")


def _describe_wanted(markers: Sequence[str]) -> str:
    return f"{len(markers)} round markers of one brightness, spaced as on the robot ({', '.join(markers)})"


def _refusal(file: str, frame: int, what: str, found: str, expected: str) -> InputError:
    step = (
        "Click the markers: `calib track SESSION --click` opens a page in the browser, and saves the boxes. "
        "Or choose another frame, in which no marker is hidden."
    )
    return InputError([Fault(file, f"frame {frame}", what, found, expected, next_step=step)])


# The page to click.


def click_page(
    rgb: np.ndarray,
    markers: Sequence[str],
    trial: str = "trial",
    frame: int = 0,
    suggested: StartBoxes | None = None,
    blobs: Sequence[Blob] = (),
    layout_m: np.ndarray | None = None,
    place: str | None = None,
) -> str:
    """Render the page on which the markers of a frame are clicked; `load_boxes` reads what it saves.

    Args:
        rgb: (h, w, 3) the frame, bytes; `frame` is its number in the video.
        markers: the markers to click, in the order in which they are asked for.
        trial: the trial's name.
        frame: number of the frame.
        suggested: boxes to begin with; the person only has to check and save them.
        blobs: places that a click snaps to (`find_blobs`); elsewhere it snaps to what stands out under it.
        layout_m: (m, 2) places on the straight robot, m, for the little map of the markers.
        place: where the saved file belongs in the session folder; None: ``trials/<trial>.boxes.json``.
    """
    folder = files("tracking") / "templates"
    style, script, page = ((folder / name).read_text("utf-8") for name in ("click.css", "click.js", "click.html.j2"))
    template = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True).from_string(page)
    boxes = suggested.to_json()["boxes"] if suggested else {}
    return template.render(
        trial=trial,
        frame=frame,
        place=place or f"trials/{trial}.boxes.json",
        style=Markup(style),  # our own file
        script=Markup(script),
        data={
            "image": _as_jpeg(rgb),
            "width": rgb.shape[1],
            "height": rgb.shape[0],
            "markers": list(markers),
            "trial": trial,
            "frame": frame,
            "suggested": {name: boxes[name] for name in markers if name in boxes},
            "blobs": [[round(value, 2) for value in blob[:3]] for blob in blobs],
            "side_px": _side_px(suggested, blobs[: len(markers)]),
            "layout": None if layout_m is None else np.asarray(layout_m, dtype=float).tolist(),
        },
    )


def _side_px(suggested: StartBoxes | None, blobs: Sequence[Blob]) -> int:
    """Return the side of new boxes: that of the suggested ones, or one that fits the diameter of the blobs."""
    if suggested:
        return round(float(np.median([box.width for box in suggested.boxes.values()])))
    if blobs:
        return round(BOX_DIAMETERS * float(np.median([blob.diameter_px for blob in blobs])))
    return round(USUAL_SIDE_PX)


def _as_jpeg(rgb: np.ndarray) -> str:
    """Encode the picture (h, w, 3) as a data URL."""
    ok, data = cv2.imencode(".jpg", np.ascontiguousarray(rgb[:, :, ::-1]), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not ok:
        raise ValueError(f"a picture of shape {rgb.shape} cannot be stored as JPEG")
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()


# Boxes that may hold no marker.


def without_marker(tracker: MarkerTracker, first: Sighting) -> np.ndarray:
    """Return (m,) bool, the boxes without a marker, of a tracker that was just begun, and what it saw first."""
    faint = tracker.faint.which if tracker.faint is not None else ~first.seen
    empty: np.ndarray = tracker.start.contrast < np.where(faint, LEAST_CONTRAST_FAINT, LEAST_CONTRAST)
    return empty | ~first.seen


def check_markers(
    video: str, grey: np.ndarray, boxes: StartBoxes, markers: Sequence[str], tracker: MarkerTracker, first: Sighting
) -> None:
    """Check that every box holds a marker.

    Args:
        video: name of the video for the message.
        grey: (h, w) uint8 picture of the boxes, in the grey that they are tracked in.
        boxes: the boxes.
        markers: names of the m markers.
        tracker: a tracker that was just begun.
        first: what it saw first.

    Raises:
        InputError: some hold none, or lie within larger markers.
    """
    names = np.array(markers)[without_marker(tracker, first)].tolist()
    if not names:
        return
    sides_px = boxes.sides_px(markers)
    centre_px = boxes.centres_px(markers)
    own, wider = (measure_appearance(grey, centre_px, by * sides_px) for by in (1.0, WIDER))
    within = (wider.contrast > CLEARER * np.maximum(own.contrast, LEAST_CONTRAST)) & (wider.diameter_px > sides_px)
    within &= _off_the_rim(grey, centre_px, WIDER * sides_px) > CLEARER * LEAST_CONTRAST
    if 2 * np.count_nonzero(within) > len(within):  # a box beside its marker says nothing, however wide
        step = (
            f"The boxes of {np.median(sides_px):.0f} px seem to lie within discs of "
            f"{np.median(wider.diameter_px):.0f} px: draw each around its whole dot, `calib track SESSION --click`."
        )
    else:
        step = (
            "Are the boxes of this film? Look at their preview, or click them: `calib track SESSION --click`. Dots "
            f"that look like their body cannot be tracked: {PAINT}."
        )
    expected = f"a disc that differs from what is around it by {LEAST_CONTRAST:g} of 255, in brightness or colour"
    found = ", ".join(names)
    raise InputError([Fault(video, f"frame {boxes.frame}", "boxes without a marker", found, expected, next_step=step)])


def begin_in_box(frame: Frame, box: Box, threads: int) -> tuple[Grey, MarkerTracker, Sighting]:
    """Begin a tracker in the box of one marker; return the grey that it is tracked in, it, and what it saw first."""
    centre, side = np.array([box.centre_px]), np.array([(box.width + box.height) / 2])
    grey = Grey.chosen(frame, centre, side)
    beside = grey.brightness_beside(frame)
    return grey, *MarkerTracker.begin(grey.of(frame), centre, side, threads=threads, brightness=beside)


def check_box(video: str, frame: Frame, box: Box, marker: str) -> None:
    """Check as `check_markers` that a box set in a later frame holds its marker."""
    grey, tracker, first = begin_in_box(frame, box, threads=1)
    check_markers(video, grey.of(frame), StartBoxes(frame.number, {marker: box}), (marker,), tracker, first)


def _off_the_rim(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> np.ndarray:
    """Return (m,) grey levels by which the middle of each square differs from its rim."""
    off = []
    for (column, row), side in zip(np.rint(centre_px).astype(int).tolist(), side_px.tolist(), strict=True):
        patch = window(grey, column, row, max(round(side / 2), 2)).astype(float)
        rim = np.concatenate([patch[0], patch[-1], patch[:, 0], patch[:, -1]])
        middle = len(patch) // 2
        off.append(abs(np.median(patch[middle - 1 : middle + 2, middle - 1 : middle + 2]) - np.median(rim)))
    return np.array(off)


def doubtful_boxes(grey: np.ndarray, boxes: StartBoxes, markers: Sequence[str]) -> tuple[Flag, ...]:
    """Flag as ``doubtful_box`` each box in which the detector answers no more than on the water elsewhere.

    A marker that also lies within the levels around it is ``indistinct``, and counts nowhere; the odd one out is
    doubted for the whole trial.

    Args:
        grey: (h, w) uint8 picture of the boxes, in the grey that they are tracked in.
        boxes: the boxes.
        markers: names of the m markers.
    """
    flags = []
    centre_px, side_px = boxes.centres_px(markers), boxes.sides_px(markers)
    within = lies_within(grey, centre_px, side_px).tolist()
    for name, share, hidden in zip(markers, _common(grey, centre_px, side_px).tolist(), within, strict=True):
        if hidden and share > COMMON:
            message = (
                f"neither brightness nor colour tells {name} from what is around it and elsewhere: it counts nowhere. "
                f"Put its box onto its dot, or for the next film {PAINT}"
            )
            flags.append(Flag(INDISTINCT, (name,), None, message))
        elif share > COMMON:
            message = (
                f"{share:.0%} of the picture elsewhere looks as much like a marker as the start box of {name} does: "
                "is the box on its marker? Look at the picture of the boxes"
            )
            flags.append(Flag("doubtful_box", (name,), (boxes.frame, boxes.frame), message))
    aside_px = np.linalg.norm(move_onto_dots(grey, centre_px, side_px) - centre_px, axis=1)
    for name, off_px in zip(markers, aside_px.tolist(), strict=True):
        if off_px:
            message = (
                f"the start box of {name} lies {off_px:.0f} px beside a dot like the other markers, which is followed "
                "instead: is it the marker? Look at the picture of the boxes"
            )
            flags.append(Flag("doubtful_box", (name,), (boxes.frame, boxes.frame), message))
    odd = odd_one_out(measure_appearance(grey, centre_px, side_px))
    if odd is not None and not any(markers[odd] in flag.markers for flag in flags):
        message = (
            f"what is in the start box of {markers[odd]} is fainter than all other markers, and dark where they are "
            "bright or bright where they are dark: is it the body between two of them? Look at the picture of the boxes"
        )
        flags.append(Flag("doubtful_box", (markers[odd],), None, message))
    if ring_holes_px(grey, centre_px, side_px):
        hollow = int(np.count_nonzero(ring_radii(grey, centre_px, side_px)))
        message = (
            f"{hollow} of {len(markers)} markers look like rings, which are measured on one side, up to half their "
            "width off, or lost: for the next film fill them"
        )
        flags.append(Flag("doubtful_box", tuple(markers), None, message))
    return tuple(flags)


def odd_one_out(look: Appearance) -> int | None:
    """Return the number of the one marker that is bright where all others are dark, and fainter; None without one."""
    for sign in (-1.0, 1.0):
        alone = np.flatnonzero(look.sign == sign)
        others = look.contrast[look.sign != sign]
        if len(alone) == 1 and len(others) >= FEWEST_ALIKE and look.contrast[alone[0]] < FAINTER * others.min():
            return int(alone[0])
    return None


def _common(grey: np.ndarray, centre_px: np.ndarray, side_px: np.ndarray) -> np.ndarray:
    """Return (m,) the share of places elsewhere where the detector answers as in the box; 0 without places."""
    places_px = _elsewhere(grey, centre_px, CLEAR * float(np.median(side_px)))
    common = np.zeros(len(side_px))
    if len(places_px) < FEWEST:
        return common
    look = measure_appearance(grey, centre_px, side_px)
    diameter_px, reach_px = float(np.median(np.minimum(look.diameter_px, side_px))), int(np.median(side_px) / 2)
    for sign in np.unique(look.sign).tolist():
        usual = strongest_answer(grey, places_px, reach_px, sign, diameter_px)  # (p,)
        of_sign = np.flatnonzero(look.sign == sign)
        answers = strongest_answer(grey, centre_px[of_sign], reach_px, sign, diameter_px)
        common[of_sign] = (usual[None] >= answers[:, None]).mean(axis=1)
    return common


def _elsewhere(luma: np.ndarray, centre_px: np.ndarray, clear_px: float) -> np.ndarray:
    """Return (p, 2) places in the picture, away from all boxes."""
    height, width = luma.shape
    drawn = np.random.default_rng(0).uniform(0, [width - 1, height - 1], (PLACES, 2))
    return drawn[np.linalg.norm(drawn[:, None] - centre_px[None], axis=2).min(axis=1) > clear_px]
