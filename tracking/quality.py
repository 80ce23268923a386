"""The quality of tracks: which samples can be believed, and a flag for every one that cannot.

The judgement is made before any fit. `check_tracks` holds every sample against the shape of the body, learned from the
trial itself (`body_model`), and against its own motion (`following`), in both directions of time. The reference is
where the boxes sit in this trial; the layout of the robot speaks only where the trial cannot: two boxes never come as
close as on one spot (`touching`), and none stands still while the body moves (`standing_still`). What is wrong is
flagged in stretches with a name (`flags_of`), and weighed out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from swimcal.flags import Flag
from swimcal.robot import RobotSpec
from swimcal.tracks import markers_of, pixels_of
from tracking.body_jump import (
    exchange_of_frames_flags,
    exchanged_frames,
    find_jumps,
    flag_scattered_gaps,
    halted_rows,
    jump_flags,
    longest_part,
)
from tracking.body_model import BodyModel, centred, fit_body_model, layout_model, spacing_spread
from tracking.following import (
    Gate,
    clashing,
    fitting_shape,
    misplaced,
    reaching,
    widened,
)
from tracking.harmed_frames import (
    frozen_flags,
    frozen_picture,
    repeat_flags,
    repeated_rows,
    stopped_clock,
    stretches,
)

# Frozen boxes.
STILL_FRAMES = 5
"""A box is frozen if it stands still for at least this many frames …"""
STILL_PX = 1.0
"""… moving by no more than this over so many frames, in each coordinate …"""
STILL_MOTION_PX = 6.0
"""… while both its neighbours move by at least this, and four times as much as it, and leave it behind by as much."""
STOP_FRAMES = 2
"""A frozen box stops or goes on at once: within so many frames before or after its rest …"""
STOP_SHARE = 0.5
"""… it moves by this share of what its neighbours move meanwhile. The point about which a head turns comes to rest, and
leaves it, gently."""
CLAMPED_SPREAD = 0.1
"""A marker that rests through the trial is clamped, not frozen, if its distances vary by no more than this share."""

# Names of flagged stretches.
JUMP_FRAMES = 6
"""A stretch no longer than this is called a jump."""

# When a sample is not believed; the numbers come from five public trials (4K, about 950 px a metre).
FLOOR_PX = 5.0
"""Whatever the trial's own spread, a marker may be this far from where the others put it: clean real markers of the
tail stay within 5 px, and a fault of 8 px must be seen."""
DEVIATIONS = 4.0
"""And this many times its spread in the trial."""
LAYOUT_DEVIATIONS = 2.5
"""The same against the layout with the trial's own spacing, for the first look."""
MERGE_FRACTION, MERGE_M = 0.5, 0.012
"""Two boxes are on one spot when closer than this share of their spacing in the layout, and than about a marker."""
WIDEN = 0.7
"""A flagged stretch reaches as far as the marker is off by this share of what is allowed."""
JOIN_FRAMES = 5
"""Flagged stretches that are no further apart are one."""


def touching(position_px: np.ndarray, least_px: np.ndarray) -> np.ndarray:
    """Tell for each pair (n, m, m) whether it is closer than (m, m) `least_px`; a marker never touches itself."""
    between = np.linalg.norm(position_px[:, :, None] - position_px[:, None], axis=-1)  # (n, m, m)
    return (between < least_px) & ~np.eye(position_px.shape[1], dtype=bool)


def standing_still(position_px: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Tell (n, m) whether a marker at (n, m, 2) stands still while its two nearest in body order (m,) both move."""
    n, m, _ = position_px.shape
    still = np.zeros((n, m), dtype=bool)
    if n < STILL_FRAMES or m < 3:
        return still
    windows = np.lib.stride_tricks.sliding_window_view(position_px, STILL_FRAMES, axis=0)  # (…, m, 2, f)
    quiet = (np.ptp(windows, axis=-1) <= STILL_PX).all(axis=-1)  # (n - f + 1, m)
    rank = np.argsort(order)
    for k in range(m):
        nearest = np.argsort(np.abs(rank - rank[k]), kind="stable")[:3]  # itself first
        if _clamped(position_px[:, nearest]):
            continue
        for first, last in stretches(quiet[:, k]):
            span = slice(first, last + STILL_FRAMES)
            own, *others = np.linalg.norm(np.ptp(position_px[span][:, nearest], axis=0), axis=1)
            moving = min(others) >= max(STILL_MOTION_PX, 4 * own)  # False where a sample is missing
            if moving and _stops_at_once(position_px[:, nearest], span):
                still[span, k] = True
    return still


def _stops_at_once(position_px: np.ndarray, span: slice) -> bool:
    """Tell whether the first of three markers (n, 3, 2) that rests over a span stops or goes on abruptly.

    What is not seen tells nothing; so does a rest from the first frame to the last.
    """
    steps_px = np.linalg.norm(position_px[STOP_FRAMES:] - position_px[:-STOP_FRAMES], axis=2)  # (n - 2, 3)
    pace_px = float(np.median(steps_px[span.start : span.stop - STOP_FRAMES, 1:], axis=0).min())
    ends = [at for at in (span.start - STOP_FRAMES, span.stop - 1) if 0 <= at < len(steps_px)]
    own_px = steps_px[ends, 0]
    return not (len(own_px) and (own_px < STOP_SHARE * pace_px).all())


def _clamped(position_px: np.ndarray) -> bool:
    """Tell whether the first of three markers (n, 3, 2) rests through the trial while the others stay as far from it.

    So does the only marker of a head that is held. A box on the background does not: the robot leaves it, or turns
    round it with a bend that no robot has.
    """
    seen_px = position_px[np.isfinite(position_px).all(axis=(1, 2))]
    if len(seen_px) < STILL_FRAMES:
        return False
    low_px, high_px = np.quantile(seen_px[:, 0], (0.05, 0.95), axis=0)
    away_px = np.linalg.norm(seen_px[:, 1:] - seen_px[:, :1], axis=2)  # (n, 2)
    low, middle, high = np.quantile(away_px, (0.05, 0.5, 0.95), axis=0)
    return bool(max(high_px - low_px) <= STILL_MOTION_PX and (high - low <= CLAMPED_SPREAD * middle).all())


@dataclass(frozen=True, eq=False)
class TrackQuality:
    """Belief in each sample of a trial.

    Attributes:
        weight: (n, m) in [0, 1]: the tracker's confidence, 0 where the sample is flagged or missing.
        flags: what is wrong, by first frame; of a merge's two markers the misplaced one comes first.
    """

    weight: np.ndarray
    flags: tuple[Flag, ...]

    @property
    def used_fraction(self) -> float:
        """Share of all samples with a weight above 0; 0 if there are none."""
        return float(np.mean(self.weight > 0)) if self.weight.size else 0.0


def check_tracks(tracks: xr.Dataset, layout: RobotSpec, floor_px: float = FLOOR_PX) -> TrackQuality:
    """Judge every sample of a trial.

    Of the layout only the markers are used; a marker may always be `floor_px` from where the others put it.

    Raises:
        ValueError: a marker that the layout lacks.
    """
    if unknown := [name for name in markers_of(tracks) if name not in layout.markers]:
        raise ValueError(f"no marker {', '.join(unknown)} on {layout.name}; choices: {', '.join(layout.markers)}")
    names, seen = markers_of(tracks), np.where(tracks.confidence.values[..., None] > 0, pixels_of(tracks), np.nan)
    frozen, repeated = frozen_picture(pixels_of(tracks)), repeated_rows(pixels_of(tracks)) | halted_rows(seen)  # (n,)
    exchanged = exchanged_frames(seen)  # (n,)
    harmed = frozen | repeated | exchanged
    findings = _findings(tracks, harmed, layout, floor_px)
    believed = findings.present & ~findings.wrong
    found = find_jumps(tracks.time.values, np.where((repeated | exchanged)[:, None, None], np.nan, seen), names)
    # A jump out of a picture that stood still is flagged already.
    jumps = [(frame, off_px) for frame, off_px in found if not frozen[max(frame - 2, 0) : frame + 2].any()]
    stopped = stopped_clock(frozen, seen)
    part = longest_part(len(frozen), sorted([*stopped, *(frame for frame, _ in jumps)]))
    believed[: part.start] = believed[part.stop :] = False
    gaps = flag_scattered_gaps(jumps, len(frozen), names)
    if gaps:
        believed[:] = False
    flags = (
        *flags_of(replace(findings, present=findings.present | harmed[:, None]), names),  # these have their own
        *frozen_flags(frozen, names, stopped, part),
        *(gaps or jump_flags(jumps, part, names)),
        *repeat_flags(repeated, seen),
        *exchange_of_frames_flags(exchanged),
    )
    ordered = sorted(flags, key=lambda flag: (flag.frames or (-1,))[0])
    return TrackQuality(np.where(believed, tracks.confidence.values, 0.0), tuple(ordered))


def _findings(tracks: xr.Dataset, harmed: np.ndarray, layout: RobotSpec, floor_px: float) -> Findings:
    position_px = pixels_of(tracks) * [1.0, -1.0]  # (n, m, 2), y up: the robot frame seen from above
    position_px[harmed] = np.nan
    place_m = layout.marker_positions_m(markers_of(tracks))  # (m, 3)
    present = np.isfinite(position_px).all(axis=2)
    findings = Findings.none(present, position_px)
    px_per_m = _size(position_px, place_m)
    if px_per_m is None:
        return findings
    order = np.argsort(place_m[:, 0], kind="stable")
    told = present & (tracks.confidence.values > 0)  # what does not count tells nothing of the body's shape
    still = standing_still(position_px, order)
    root_x_m = max(marker.position_m[0] for marker in layout.markers.values() if marker.body == "head")
    prior = layout_model(place_m, root_x_m, px_per_m, layout.scale_length_m)
    spot_m, never_m = _on_one_spot(place_m, layout.scale_length_m)
    never_px = px_per_m * never_m
    prior, fitting, clash = _first_look(prior, position_px, told & ~still, never_px, floor_px)

    gate = Gate(floor_px, DEVIATIONS)
    judged = told & ~still & ~clash
    model = fit_body_model(prior, position_px, fitting)
    for _ in range(2):  # the second time without the faults in the model
        fitting = fitting_shape(model, position_px, judged, fitting, gate)
        wrong = clash | misplaced(model, tracks.time.values, position_px, judged, fitting, gate)
        fitting = judged & ~wrong
        model = fit_body_model(prior, position_px, fitting)
        if not wrong.any():
            break
    believed = judged & ~wrong
    put_px = model.put_by_others(position_px, believed)
    off_px = np.nan_to_num(np.linalg.norm(position_px - put_px, axis=2))  # (n, m)
    still = reaching(still, off_px, STILL_MOTION_PX)
    far = present & (off_px > WIDEN * gate.allowed_px(model.shape_and_pose, believed))
    wrong = present & widened(wrong | still, far, JOIN_FRAMES)
    wrong = reaching(wrong, off_px, WIDEN * floor_px)
    touch = touching(position_px, px_per_m * spot_m)
    return replace(findings, wrong=wrong, still=still, touch=touch, put_px=put_px, order=order)


def _on_one_spot(place_m: np.ndarray, unit_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (m, m) distance below which two markers are on one spot, m; the same with 0 for pairs that may be.

    They are those whose spacing is hardly beyond it, as boxes are placed by hand and seen in perspective.
    """
    spacing_m = np.linalg.norm(place_m[:, None, :2] - place_m[None, :, :2], axis=-1)
    spot_m = np.minimum(MERGE_FRACTION * spacing_m, MERGE_M)
    never = spacing_m - 2 * spacing_spread(place_m, unit_m) > spot_m
    return spot_m, np.where(never, spot_m, 0.0)


def _size(position_px: np.ndarray, place_m: np.ndarray) -> float | None:
    """Return the pixels a metre, the median over all pairs and frames; None with fewer than three markers."""
    one, other = np.triu_indices(len(place_m), 1)
    apart_px = np.linalg.norm(position_px[:, one] - position_px[:, other], axis=-1)  # (n, pairs)
    ratio = apart_px / np.linalg.norm(place_m[one, :2] - place_m[other, :2], axis=-1)
    ratio = ratio[np.isfinite(ratio)]
    return float(np.median(ratio)) if len(place_m) > 2 and len(ratio) and np.median(ratio) > 0 else None


def _first_look(
    prior: BodyModel,
    position_px: np.ndarray,
    present: np.ndarray,
    never_px: np.ndarray,
    floor_px: float,
) -> tuple[BodyModel, np.ndarray, np.ndarray]:
    """Fit the layout with the trial's spacing roughly; return it, what fits it (n, m), what sits on another (n, m)."""
    gate = Gate(floor_px, LAYOUT_DEVIATIONS)
    fitting = present & ~touching(position_px, never_px).any(axis=2)
    for _ in range(2):
        prior = centred(prior, position_px, fitting)
        clash = clashing(prior, position_px, present, never_px)
        fitting = fitting_shape(prior, position_px, present & ~clash, fitting, gate)
    return prior, fitting, clash


# Names for what is wrong.


@dataclass(frozen=True, eq=False)
class Findings:
    """Findings about each sample."""

    present: np.ndarray  # (n, m) not missing
    wrong: np.ndarray  # (n, m) present but misplaced
    still: np.ndarray  # (n, m) standing still while the neighbours move
    touch: np.ndarray  # (n, m, m) two markers on one spot
    position_px: np.ndarray  # (n, m, 2)
    put_px: np.ndarray  # (n, m, 2) where the other markers put it
    order: np.ndarray  # (m,) the markers from nose to tail

    @classmethod
    def none(cls, present: np.ndarray, position_px: np.ndarray) -> Findings:
        """Make findings of nothing wrong but what is missing."""
        n, m = present.shape
        nothing, touch = np.zeros((n, m), dtype=bool), np.zeros((n, m, m), dtype=bool)
        return cls(present, nothing, nothing, touch, position_px, position_px, np.arange(m))


def flags_of(findings: Findings, markers: tuple[str, ...]) -> tuple[Flag, ...]:
    """Make one flag for each stretch of each marker, by first frame."""
    flags: list[Flag] = []
    for k, name in enumerate(markers):
        for first, last in stretches(~findings.present[:, k]):
            flags.append(Flag("gap", (name,), (first, last), f"{name} is missing in {_frames(first, last)}"))
        for first, last in stretches(findings.wrong[:, k]):
            flag = _named(findings, markers, k, first, last)
            if not any(_says_the_same(flag, other) for other in flags):
                flags.append(flag)
    return tuple(sorted(flags, key=lambda flag: (flag.frames or (0, 0), flag.markers)))


def _named(findings: Findings, markers: tuple[str, ...], k: int, first: int, last: int) -> Flag:
    span, long, concerned = slice(first, last + 1), last - first + 1, markers[k : k + 1]
    off_px = np.linalg.norm(findings.position_px[span, k] - findings.put_px[span, k], axis=1).max()
    touched = findings.touch[span, k].sum(axis=0)  # (m,) frames
    other = int(touched.argmax())
    if 2 * touched[other] >= long:
        concerned = (markers[k], markers[other])
        kind, text = "merged_markers", f"{markers[k]} sits on {markers[other]}: {_apart(findings, k, other, span)}"
        if 2 * findings.wrong[span, other].sum() >= long:
            text += "; both are left out"
    elif 2 * findings.still[span, k].sum() >= long:
        kind, text = "frozen_marker", f"{markers[k]} stands still while the body moves, {off_px:.0f} px away at most"
    elif long <= JUMP_FRAMES:
        kind, text = "jump", f"{markers[k]} jumps, {off_px:.0f} px from where the others put it at most"
    else:
        other = _neighbour(findings, k, span)
        kind = "segment_length"
        text = f"{markers[k]} is {off_px:.0f} px out of place at most; "
        text += f"from {markers[other]} {_apart(findings, k, other, span)}"
    return Flag(kind, concerned, (first, last), f"{text} ({_frames(first, last)})")


def _says_the_same(flag: Flag, other: Flag) -> bool:
    """Tell whether another flag names the same merge from its other side."""
    merge = flag.kind == other.kind == "merged_markers"
    return merge and flag.markers == other.markers[::-1] and flag.frames == other.frames


def _apart(findings: Findings, k: int, other: int, span: slice) -> str:
    """Describe the median distance between two markers over a stretch: found, and expected where that differs."""
    found = np.linalg.norm(findings.position_px[span, k] - findings.position_px[span, other], axis=1)
    expected = np.linalg.norm(findings.put_px[span, k] - findings.put_px[span, other], axis=1)
    if np.isnan(found).all():
        return f"expected {np.median(expected):.0f} px"
    apart_px, usual_px = (f"{np.nanmedian(each):.0f} px" for each in (found, expected))
    if apart_px == usual_px:
        return f"{apart_px} as expected, in another direction"
    return f"{apart_px}, expected {usual_px}"


def _neighbour(findings: Findings, k: int, span: slice) -> int:
    """Return the nearest marker in body order that is in place for most of the stretch, else the nearest."""
    rank = np.argsort(findings.order)
    near = [int(j) for j in np.argsort(np.abs(rank - rank[k]), kind="stable") if j != k]
    bad = (findings.wrong | ~findings.present)[span].mean(axis=0)
    return next((j for j in near if bad[j] < 0.5), near[0])


def _frames(first: int, last: int) -> str:
    return f"frame {first}" if first == last else f"{last - first + 1} frames"
