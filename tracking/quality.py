"""Track quality: which samples of a trial to believe, and what is wrong with the others.

The judgement is made before any fit. Every sample is held against the shape of the body, learned from the
trial itself (`tracking.body_model`), and against its own motion (`tracking.following`), in both directions
of time. The reference is where the boxes sit in this trial; the layout of the robot speaks only where the
trial cannot: two boxes never come as close as on one spot. What is wrong is flagged in stretches with a name,
and weighed out.
"""

from dataclasses import dataclass, replace

import numpy as np

from session import Flag, Tracks
from swimmer.robot import RobotSpec
from tracking.body_model import BodyModel, centred, layout_model, learned, spacing_spread
from tracking.following import Gate, fitting_shape
from tracking.misplaced import clashing, misplaced, reaching, widened
from tracking.quality_flags import Findings, flags_of, frozen_flags, frozen_picture
from tracking.suspects import standing_still, touching


@dataclass(frozen=True)
class QualityLimits:
    """When a sample is not believed. The defaults come from five public trials (4K, about 950 px a metre).

    Attributes:
        floor_px: whatever the trial's own spread, a marker may be this far from where the others put it:
            clean real markers of the tail stay within 5 px, and a fault of 8 px must be seen.
        deviations: and this many times its spread in the trial.
        layout_deviations: the same against the layout with the trial's own spacing, for the first look.
        merge_fraction: two boxes are on one spot when closer than this share of their spacing in the layout …
        merge_m: … and than this, about the size of a marker.
        still_frames: a box is frozen if it stands still for at least this many frames …
        still_px: … moving by no more than this over so many frames, in each coordinate …
        still_motion_px: … while both its neighbours move by at least this and leave it behind by as much.
        widen: a flagged stretch reaches as far as the marker is off by this share of what is allowed.
        join_frames: flagged stretches that are no further apart are one.
        jump_frames: a stretch no longer than this is called a jump.
        frozen_frames: the picture is frozen if no marker at all moves for so many frames …
        frozen_motion_px: … and just before or after one moves by this in a frame.
    """

    floor_px: float = 5.0
    deviations: float = 4.0
    layout_deviations: float = 2.5
    merge_fraction: float = 0.5
    merge_m: float = 0.012
    still_frames: int = 5
    still_px: float = 1.0
    still_motion_px: float = 6.0
    widen: float = 0.7
    join_frames: int = 5
    jump_frames: int = 6
    frozen_frames: int = 6
    frozen_motion_px: float = 2.0


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


def check_tracks(tracks: Tracks, layout: RobotSpec, limits: QualityLimits | None = None) -> TrackQuality:
    """Judges every sample of a trial.

    Args:
        tracks: of n frames and m markers, in any order.
        layout: the robot, of which only the markers are used.
        limits: when a sample is not believed.

    Raises:
        ValueError: a marker that the layout lacks.
    """
    if unknown := [name for name in tracks.markers if name not in layout.markers]:
        raise ValueError(f"no marker {', '.join(unknown)} on {layout.name}; choices: {', '.join(layout.markers)}")
    limits = limits or QualityLimits()
    findings = _findings(tracks, layout, limits)
    frozen = frozen_picture(tracks.position_px, limits.frozen_frames, limits.frozen_motion_px)  # (n,)
    believed = findings.present & ~findings.wrong & ~frozen[:, None]
    flags = (*flags_of(findings, tracks.markers), *frozen_flags(frozen, tracks.markers))
    return TrackQuality(np.where(believed, tracks.confidence, 0.0), tuple(sorted(flags, key=_first_frame)))


def _first_frame(flag: Flag) -> int:
    return -1 if flag.frames is None else flag.frames[0]


def _findings(tracks: Tracks, layout: RobotSpec, limits: QualityLimits) -> Findings:
    position_px = tracks.position_px * [1.0, -1.0]  # (n, m, 2), y up: the robot frame seen from above
    place_m = layout.marker_positions_m(tracks.markers)  # (m, 3)
    present = np.isfinite(position_px).all(axis=2)
    findings = Findings.none(present, position_px, limits.jump_frames)
    px_per_m = _size(position_px, place_m)
    if px_per_m is None:
        return findings
    order = np.argsort(place_m[:, 0], kind="stable")
    still = standing_still(position_px, order, limits.still_frames, limits.still_px, limits.still_motion_px)
    root_x_m = max(marker.position_m[0] for marker in layout.markers.values() if marker.body == "head")
    prior = layout_model(place_m, root_x_m, px_per_m, layout.scale_length_m)
    spot_m, never_m = _on_one_spot(place_m, layout.scale_length_m, limits)
    never_px = px_per_m * never_m
    prior, fitting, clash = _first_look(prior, position_px, present & ~still, never_px, limits)

    gate = Gate(limits.floor_px, limits.deviations)
    judged = present & ~still & ~clash
    model = learned(prior, position_px, fitting)
    for _ in range(2):  # the second time without the faults in the model
        fitting = fitting_shape(model, position_px, judged, fitting, gate)
        wrong = clash | misplaced(model, tracks.time_s, position_px, judged, fitting, gate)
        fitting = judged & ~wrong
        model = learned(prior, position_px, fitting)
        if not wrong.any():
            break
    believed = judged & ~wrong
    put_px = model.put_by_others(position_px, believed)
    off_px = np.nan_to_num(np.linalg.norm(position_px - put_px, axis=2))  # (n, m)
    still = reaching(still, off_px, limits.still_motion_px)
    far = present & (off_px > limits.widen * gate.allowed_px(model.shape_and_pose, believed))
    wrong = present & widened(wrong | still, far, limits.join_frames)
    wrong = reaching(wrong, off_px, limits.widen * limits.floor_px)
    touch = touching(position_px, px_per_m * spot_m)
    return replace(findings, wrong=wrong, still=still, touch=touch, put_px=put_px, order=order)


def _on_one_spot(place_m: np.ndarray, unit_m: float, limits: QualityLimits) -> tuple[np.ndarray, np.ndarray]:
    """(m, m) distance below which two markers are on one spot, m; the same with 0 for pairs that may be.

    They are those whose spacing is hardly beyond it, as boxes are placed by hand and seen in perspective.
    """
    spacing_m = np.linalg.norm(place_m[:, None, :2] - place_m[None, :, :2], axis=-1)
    spot_m = np.minimum(limits.merge_fraction * spacing_m, limits.merge_m)
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
    limits: QualityLimits,
) -> tuple[BodyModel, np.ndarray, np.ndarray]:
    """A rough judgement by the layout, with the trial's own spacing.

    Returns:
        the layout with the trial's spacing; (n, m) the samples that fit it; (n, m) those that sit on another.
    """
    gate = Gate(limits.floor_px, limits.layout_deviations)
    fitting = present & ~touching(position_px, never_px).any(axis=2)
    for _ in range(2):
        prior = centred(prior, position_px, fitting)
        clash = clashing(prior, position_px, present, never_px)
        fitting = fitting_shape(prior, position_px, present & ~clash, fitting, gate)
    return prior, fitting, clash
