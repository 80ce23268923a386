"""Pictures of a clip, any frame at a time: pool, body, glints, markers, poles, noise."""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np

from benchmarks.video.body import Body
from benchmarks.video.glints import Glints
from benchmarks.video.motion import Pose
from benchmarks.video.picture import Picture, Region, colour_of, disc_cover
from benchmarks.video.plan import ClipPlan
from benchmarks.video.stage import Stage, stage_of
from benchmarks.video.truth import ClipTruth
from benchmarks.video.water import TINT, Water

_BASE_WIDER_PX = 3.0
_NOISE_PLACES = 64
_BODY_MOMENTS = 4
_STILL_PX = 1.5  # A body that moves less in an exposure is painted once.
_SHADOW_M = (0.10, -0.07)  # shift of the shadow on the floor, as the lamp is off the vertical
_GLOW_HZ = 1.3


class PoolScene:
    """A clip ready to be painted, frame by frame in any order; the same plan gives the same pixels.

    Args:
        plan: plan of the clip.
        stage: places of its markers; default: those of the plan's own swim.
    """

    def __init__(self, plan: ClipPlan, stage: Stage | None = None) -> None:
        self.plan = plan
        self.stage = stage_of(plan) if stage is None else stage
        optics, marker = plan.optics, plan.marker_look
        self._size = (optics.width_px, optics.height_px)
        self._water = Water(plan.water, *self._size, optics.px_per_m, plan.seed)
        self._body = Body(plan.swimmer, TINT, marker.body_gray)
        random = np.random.default_rng([plan.seed, 2])
        self._glints = Glints(plan.glints_per_s, self.stage.time_s, self.stage.shown_px, self._size, random)
        self._glow_phase = 2 * np.pi * random.random(len(plan.markers))

    def __len__(self) -> int:
        return len(self.stage.time_s)

    @cached_property
    def truth(self) -> ClipTruth:
        """Truth of the clip."""
        share = np.array([self._measure_visible_share(number) for number in range(len(self))])
        return ClipTruth(
            markers=self.plan.markers,
            time_s=self.stage.time_s,
            position_px=self.stage.position_px,
            shown_px=self.stage.shown_px,
            visible_share=share,
            diameter_px=2 * self._radius_px,
        )

    def picture(self, number: int) -> Picture:
        """Paint a frame."""
        picture = Picture(*self._size)
        time_s = float(self.stage.time_s[number])
        poses = self._sample_poses(number)
        camera = self.stage.camera
        self._water.paint(picture, time_s, self._cast_shadow(poses))
        self._body.paint(picture, camera, poses)
        self._glints.paint(picture, time_s)
        self._paint_markers(picture, number)
        for occlusion, tip_px in self._list_tips(number):
            occlusion.paint(picture, tip_px)
        self._add_noise(picture, number)
        return picture

    @cached_property
    def _radius_px(self) -> np.ndarray:
        """(m,) radii as the camera sees them, higher ones larger."""
        robot, camera = self.plan.swimmer, self.stage.camera
        height_m = robot.marker_positions_m(self.plan.markers)[:, 2] - robot.marker_positions_m(("nose",))[0, 2]
        return self.plan.diameter_px / 2 * camera.scale_at(height_m) / camera.px_per_m

    def _paint_markers(self, picture: Picture, number: int) -> None:
        """Paint all bases first, so that none covers the marker next to it."""
        look, blur_px = self.plan.marker_look, self.plan.optics.blur_px
        exposed_px = np.moveaxis(self.stage.exposed_px[number], 1, 0)  # (m, s, 2)
        base = colour_of(*3 * (look.base_gray,))
        for centre_px, radius_px in zip(exposed_px, self._radius_px, strict=True):
            picture.paint_discs(centre_px, radius_px + _BASE_WIDER_PX, base, blur_px)
        turn = 2 * np.pi * _GLOW_HZ * self.stage.time_s[number] + self._glow_phase
        gray = np.clip(look.gray * (1 + look.glow * np.sin(turn)), 0, 255)
        for centre_px, radius_px, level in zip(exposed_px, self._radius_px, gray, strict=True):
            picture.paint_discs(centre_px, radius_px, colour_of(level, level, 0.97 * level), blur_px)

    def _sample_poses(self, number: int) -> Pose:
        """Return poses of the body at the moments of an exposure; one where it hardly moves."""
        exposed_px = self.stage.exposed_px[number]  # (s, m, 2)
        moved_px = np.linalg.norm(exposed_px[-1] - exposed_px[0], axis=1).max()
        moments = 1 if moved_px < _STILL_PX else _BODY_MOMENTS
        within_s = self.plan.optics.exposure_s * ((np.arange(moments) + 0.5) / moments - 0.5)
        delay_s = self.stage.camera.delay_s(exposed_px[..., 1].mean())
        return self.stage.motion.at(self.stage.time_s[number] + delay_s + within_s)

    def _cast_shadow(self, poses: Pose) -> np.ndarray:
        outline_px = self._body.outline_px(self.stage.camera, Pose(poses.head[0], poses.hinges_rad[0]))
        return outline_px + self.stage.camera.px_per_m * np.array(_SHADOW_M) * (1, -1)

    def _list_tips(self, number: int) -> list[tuple]:
        """List the occlusions, each with where its tip is in a frame."""
        places = self.stage.shown_px[number]
        plan = self.plan
        return [(each, each.tip_px(number, places[plan.markers.index(each.marker)])) for each in plan.occlusions]

    def _measure_visible_share(self, number: int) -> np.ndarray:
        """Return the (m,) visible share of each disc's area."""
        tips, exposed_px = self._list_tips(number), self.stage.exposed_px[number]
        reach = self._radius_px + 4
        low, high = exposed_px.min(axis=0) - reach[:, None], exposed_px.max(axis=0) + reach[:, None]
        inside = (low >= 0).all(axis=1) & (high <= np.array(self._size) - 1).all(axis=1)
        share = np.ones(len(reach))
        for i in np.flatnonzero(~inside | bool(tips)):
            region = Region(*(int(c) for c in (*np.floor(low[i]), *np.ceil(high[i]) + 1)))
            disc = disc_cover(region, exposed_px[:, i], self._radius_px[i], self.plan.optics.blur_px)
            x, y = region.grid()
            seen = ((x >= 0) & (x < self._size[0]) & (y >= 0) & (y < self._size[1])).astype(float)
            for occlusion, tip_px in tips:
                seen = seen * (1 - occlusion.cover(region, tip_px)[0])
            share[i] = np.sum(disc * seen) / np.sum(disc)
        return share

    @cached_property
    def _noise(self) -> np.ndarray:
        """(h, w) uint8 noise about 128, larger than the picture: each frame takes another part of it."""
        random = np.random.default_rng([self.plan.seed, 3])
        shape = (self._size[1] + _NOISE_PLACES, self._size[0] + _NOISE_PLACES)
        levels = 128 + self.plan.optics.noise * random.standard_normal(shape, dtype=np.float32)
        return np.clip(np.round(levels), 0, 255).astype(np.uint8)

    def _add_noise(self, picture: Picture, number: int) -> None:
        if not self.plan.optics.noise:
            return
        random = np.random.default_rng([self.plan.seed, 4, number])
        for plane in (picture.luma, picture.blue, picture.red):
            (top, left), (height, width) = random.integers(0, _NOISE_PLACES, 2), plane.shape
            cv2.addWeighted(plane, 1.0, self._noise[top : top + height, left : left + width], 1.0, -128.0, dst=plane)
