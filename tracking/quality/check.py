"""Track quality: which samples of a trial to believe, and what is wrong with the others.

The judgement is made before any fit. Every sample is held against the shape of the body, learned from the
trial itself (`body_model`), and against its own motion (`following`), in both directions of time. The reference is
where the boxes sit in this trial; the layout of the robot speaks only where the trial cannot: two boxes never come as
close as on one spot. What is wrong is flagged in stretches with a name (`naming`), and weighed out.
"""

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from session import Flag
from session.tracks import markers_of, pixels_of
from swimmer.robot import RobotSpec
from tracking.quality.body_jump import body_jumps, jump_flags, longest_part
from tracking.quality.body_model import BodyModel, centred, layout_model, learned, spacing_spread
from tracking.quality.following import Gate, fitting_shape
from tracking.quality.misplaced import clashing, misplaced, reaching, widened
from tracking.quality.naming import Findings, flags_of, frozen_flags, frozen_picture
from tracking.quality.suspects import STILL_MOTION_PX, standing_still, touching

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


@dataclass(frozen=True, eq=False)
class TrackQuality:
    """How far each sample of a trial can be believed.

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
    """Judges every sample of a trial.

    Of the layout only the markers are used; a marker may always be `floor_px` from where the others put it.

    Raises:
        ValueError: a marker that the layout lacks.
    """
    if unknown := [name for name in markers_of(tracks) if name not in layout.markers]:
        raise ValueError(f"no marker {', '.join(unknown)} on {layout.name}; choices: {', '.join(layout.markers)}")
    findings = _findings(tracks, layout, floor_px)
    frozen = frozen_picture(pixels_of(tracks))  # (n,)
    believed = findings.present & ~findings.wrong & ~frozen[:, None]
    jumps, names = _body_jumps(tracks, frozen), markers_of(tracks)
    part = longest_part(len(frozen), [frame for frame, _ in jumps])
    believed[: part.start] = believed[part.stop :] = False
    flags = (*flags_of(findings, names), *frozen_flags(frozen, names), *jump_flags(jumps, part, names))
    return TrackQuality(np.where(believed, tracks.confidence.values, 0.0), tuple(sorted(flags, key=_first_frame)))


def _body_jumps(tracks: xr.Dataset, frozen: np.ndarray) -> list[tuple[int, float]]:
    """Jumps of the whole body, but for those out of a picture that stood still, which is flagged already."""
    seen = np.where(tracks.confidence.values[..., None] > 0, pixels_of(tracks), np.nan)
    found = body_jumps(tracks.time.values, seen)
    return [(frame, off_px) for frame, off_px in found if not frozen[max(frame - 2, 0) : frame + 2].any()]


def _first_frame(flag: Flag) -> int:
    return -1 if flag.frames is None else flag.frames[0]


def _findings(tracks: xr.Dataset, layout: RobotSpec, floor_px: float) -> Findings:
    position_px = pixels_of(tracks) * [1.0, -1.0]  # (n, m, 2), y up: the robot frame seen from above
    place_m = layout.marker_positions_m(markers_of(tracks))  # (m, 3)
    present = np.isfinite(position_px).all(axis=2)
    findings = Findings.none(present, position_px)
    px_per_m = _size(position_px, place_m)
    if px_per_m is None:
        return findings
    order = np.argsort(place_m[:, 0], kind="stable")
    still = standing_still(position_px, order)
    root_x_m = max(marker.position_m[0] for marker in layout.markers.values() if marker.body == "head")
    prior = layout_model(place_m, root_x_m, px_per_m, layout.scale_length_m)
    spot_m, never_m = _on_one_spot(place_m, layout.scale_length_m)
    never_px = px_per_m * never_m
    prior, fitting, clash = _first_look(prior, position_px, present & ~still, never_px, floor_px)

    gate = Gate(floor_px, DEVIATIONS)
    judged = present & ~still & ~clash
    model = learned(prior, position_px, fitting)
    for _ in range(2):  # the second time without the faults in the model
        fitting = fitting_shape(model, position_px, judged, fitting, gate)
        wrong = clash | misplaced(model, tracks.time.values, position_px, judged, fitting, gate)
        fitting = judged & ~wrong
        model = learned(prior, position_px, fitting)
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
    """(m, m) distance below which two markers are on one spot, m; the same with 0 for pairs that may be.

    They are those whose spacing is hardly beyond it, as boxes are placed by hand and seen in perspective.
    """
    spacing_m = np.linalg.norm(place_m[:, None, :2] - place_m[None, :, :2], axis=-1)
    spot_m = np.minimum(MERGE_FRACTION * spacing_m, MERGE_M)
    never = spacing_m - 2 * spacing_spread(place_m, unit_m) > spot_m
    return spot_m, np.where(never, spot_m, 0.0)


def _size(position_px: np.ndarray, place_m: np.ndarray) -> float | None:
    """Pixels a metre, the median over all pairs and frames; None with fewer than three markers."""
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
    """A rough look: the layout with the trial's spacing; (n, m) what fits it; (n, m) what sits on another."""
    gate = Gate(floor_px, LAYOUT_DEVIATIONS)
    fitting = present & ~touching(position_px, never_px).any(axis=2)
    for _ in range(2):
        prior = centred(prior, position_px, fitting)
        clash = clashing(prior, position_px, present, never_px)
        fitting = fitting_shape(prior, position_px, present & ~clash, fitting, gate)
    return prior, fitting, clash
