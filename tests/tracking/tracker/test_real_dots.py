"""Dots as people have them: coloured, near the rim of a body, on balls with a highlight, growing, in sun and shade."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import cv2
import numpy as np
import pytest
import xarray as xr

from benchmarks.video.writer import VideoWriter
from swimcal.errors import InputError
from tests.cases import later
from tracking.appearance import Grey, stands_out
from tracking.boxes import Box, StartBoxes
from tracking.find_boxes import doubtful_boxes
from tracking.follow_video import Find, follow_video
from tracking.tracker import MarkerTracker
from tracking.video import Frame, Video

NAMES = ("nose", "neck", "tail_1", "tail_2", "tail_3")
SIZE = (420, 300)
Colour = tuple[float, float, float]
GREEN, RED, BLUE, YELLOW = (30, 225, 60), (235, 45, 50), (60, 60, 225), (240, 200, 60)
WALL, DARK, STRIP = (140, 150, 150), (25, 25, 28), (222, 222, 218)  # the wall is as bright as the green dots


@dataclass(frozen=True)
class Clip:
    """A body that sways in front of a wall, with a dot of its own colour at each of five places."""

    dots: tuple[Colour, ...] = (GREEN, RED, BLUE, YELLOW, GREEN)
    body: Colour = DARK
    off_px: float = 7.0  # dots from the middle of the body: half of each is over the rim
    diameter_px: Callable[[int], float] = lambda _frame: 16.0
    highlight: float = 0.0  # share of a ball's diameter
    light: Callable[[int], np.ndarray | float] = lambda _frame: 1.0  # over the picture's columns
    box: float = 1.0  # share of the dot's diameter
    start_px: float = 90.0  # first dot, from the left
    speed_px: float = 0.4  # a frame
    bar_px: tuple[int, int] = (0, 0)  # columns that a pale bar covers
    boxes_in: int = 0  # number of the frame of the boxes
    wall: Colour = WALL
    bubbles: int = 0  # number of white ones that rise past the dots
    hidden: range = range(0)  # frames in which the wall covers the last two dots
    line: float = 0.0  # share of its diameter that the line of a ring is wide; a disc without one
    vivid: float = 0.0  # share of the last frame's diameter that a patch of a purer colour reaches, on the left

    def places(self, frame: int) -> np.ndarray:
        """(5, 2) px."""
        scale = self.diameter_px(frame) / self.diameter_px(0)
        along = np.arange(5)[:, None] * [55.0 * scale, 0.0] + [self.start_px, 0.0]
        sway = 18 * np.linspace(0, 1, 5) * np.sin(2 * np.pi * frame / 30)
        return along + np.stack([np.full(5, self.speed_px * frame), 150 + sway], axis=1)

    def frame(self, number: int) -> np.ndarray:
        """(h, w, 3) uint8, drawn four times finer than it is kept."""
        fine, diameter = 4, self.diameter_px(number)
        at = self.places(number)
        middle = at - [0.0, self.off_px]
        picture = np.full((SIZE[1] * fine, SIZE[0] * fine, 3), self.wall, np.uint8)

        def pixel(place: np.ndarray) -> tuple[int, int]:
            x, y = np.rint(fine * (place + 0.5) - 0.5).astype(int).tolist()
            return x, y

        body = [pixel(place) for place in middle]
        cv2.polylines(picture, [np.array(body)[:, None]], False, self.body, round(fine * (2 * self.off_px + 2)))
        for place, colour in zip(at, self.dots, strict=True):
            line = round(fine * self.line * diameter)
            cv2.circle(picture, pixel(place), round((fine * diameter - line) / 2), colour, line or -1)
            if self.vivid:
                patch = pixel(place - [0.25 * diameter, 0.0])
                purer = [min(255, level + 50) if level > 110 else max(0, level - 60) for level in colour]
                cv2.circle(picture, patch, round(fine * self.vivid * diameter * min(number, 60) / 120), purer, -1)
            if self.highlight:
                shine = place - 0.2 * diameter
                cv2.circle(picture, pixel(shine), round(fine * self.highlight * diameter / 2), (245, 240, 245), -1)
        for bubble in range(self.bubbles):
            rises = np.array([100 + 230 * bubble / self.bubbles + 0.8 * number, 120 + (37 * bubble - 3 * number) % 70])
            cv2.circle(picture, pixel(rises), round(fine * diameter / 2), (238, 240, 242), -1)
        small = cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA).astype(float)
        small[:, slice(*self.bar_px)] = 220.0
        if number in self.hidden:
            small[:, round((at[2, 0] + at[3, 0]) / 2) :] = self.wall
        light = np.broadcast_to(self.light(number), SIZE[0])[None, :, None]
        noisy = light * small + np.random.default_rng(number).normal(0, 1.5, small.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)

    def boxes(self) -> StartBoxes:
        frame = self.boxes_in
        side = self.box * self.diameter_px(frame)
        return StartBoxes(frame, {k: Box.around(at, side) for k, at in zip(NAMES, self.places(frame), strict=True)})

    def tracked(self, folder: Path, frames: int = 45, find: Find | None = None) -> xr.Dataset:
        with VideoWriter(folder / "clip.mp4", *SIZE, fps=30, crf=18) as writer:
            for number in range(frames):
                writer.write(self.frame(number))
        with Video(folder / "clip.mp4") as video:
            return follow_video(video, self.boxes(), NAMES, find=find)

    def off(self, folder: Path, frames: int = 45, find: Find | None = None) -> np.ndarray:
        """(n, 5) px between the tracks and the truth; nan where a marker is lost."""
        tracked = self.tracked(folder, frames, find)
        place = tracked.position.transpose("time", "keypoint", "space").values
        seen = tracked.state.values == 1
        return np.where(seen, np.linalg.norm(place - [self.places(k) for k in range(frames)], axis=2), np.nan)


@pytest.mark.long
def test_coloured_dots_as_bright_as_the_wall_are_tracked_by_their_colour(tmp_path: Path) -> None:
    assert Clip().off(tmp_path).max() < 0.6


def test_a_highlight_does_not_draw_a_ball_aside(tmp_path: Path) -> None:
    ball = Clip(dots=((150, 60, 200),) * 5, body=STRIP, diameter_px=lambda _: 36.0, highlight=0.25)

    assert np.sqrt((ball.off(tmp_path) ** 2).mean()) < 0.9  # 1.5 with the hole


@pytest.mark.parametrize("diameter_px", [44.0, *later(18.0, 28.0)])
def test_a_patch_of_purer_colour_that_grows_on_a_ball_does_not_draw_it_aside(
    diameter_px: float, tmp_path: Path
) -> None:
    """As on a ball that is half in the shade; an ever smaller disc about the patch was once taken for it."""
    ball = Clip(dots=((150, 70, 190),) * 5, body=STRIP, diameter_px=lambda _: diameter_px, vivid=0.35, speed_px=0.2)

    assert ball.off(tmp_path, frames=70).max() < 1.0


@pytest.mark.parametrize("line", [0.15, *later(0.25)])
@pytest.mark.parametrize("colours", [((235, 235, 235), DARK), ((20, 20, 20), STRIP), (YELLOW, DARK)])
def test_rings_are_measured_in_their_middle(colours: tuple[Colour, Colour], line: float, tmp_path: Path) -> None:
    ring, ground = colours
    clip = Clip(dots=(ring,) * 5, body=ground, wall=ground, line=line)

    assert clip.off(tmp_path).max() < 0.6  # half their width where only one side of them was seen


@pytest.mark.parametrize("seed", range(4))
def test_of_a_box_that_holds_much_of_the_base_of_a_dot_the_dot_is_measured(seed: int) -> None:
    """White tags with a black dot, half of them on a white wall: they are no rings, and stand out less."""
    random = np.random.default_rng(seed)
    diameter, tag, box = random.uniform(14, 22), random.uniform(2.2, 2.7), random.uniform(1.6, 2.2)
    fine, places = 4, np.arange(7)[:, None] * [90.0, 0.0] + [60.0, 60.0] + random.uniform(-3, 3, (7, 2))
    luma = np.full((120 * fine, 660 * fine), 32, np.uint8)
    luma[:, : 285 * fine] = 183
    for x, y in fine * (places + 0.5):
        half = fine * tag * diameter / 2
        cv2.rectangle(luma, (round(x - half), round(y - half)), (round(x + half), round(y + half)), 190, -1)
        cv2.circle(luma, (round(x - 0.5), round(y - 0.5)), round(fine * diameter / 2), 30, -1)
    luma = cv2.resize(luma, None, fx=1 / fine, fy=1 / fine, interpolation=cv2.INTER_AREA)
    luma = np.clip(cv2.GaussianBlur(luma, (0, 0), 0.8) + random.normal(0, 2, luma.shape), 0, 255).astype(np.uint8)
    frame = cast(Frame, SimpleNamespace(luma=luma, yuv=lambda: np.dstack([luma, *np.full((2, *luma.shape), 128)])))
    names = tuple(f"marker_{number}" for number in range(7))
    boxes = StartBoxes(
        0,
        {
            k: Box.around(at, box * diameter)
            for k, at in zip(names, places + random.uniform(-1, 1, (7, 2)), strict=True)
        },
    )

    grey = Grey.of_boxes(frame, boxes, names)
    tracker, first = MarkerTracker.begin(grey.of(frame), boxes.centres_px(names), boxes.sides_px(names), use_csrt=False)
    assert tracker.start.diameter_px == pytest.approx(diameter, rel=0.15)
    assert np.linalg.norm(first.position_px - places, axis=1).max() < 0.5


def test_a_white_dot_among_coloured_ones_one_of_which_is_as_bright_as_the_water_beside_it() -> None:
    """White has no colour, and the green dot near the rim no contrast: each is told by the other."""
    picture = np.full((120, 420, 3), (95, 130, 140), np.uint8)
    picture[30:90, 20:380] = DARK
    places = np.arange(5)[:, None] * [75.0, 0.0] + [70.0, 60.0]
    for (x, y), colour in zip(
        places.astype(int).tolist(), (YELLOW, RED, (240, 240, 240), BLUE, (40, 170, 60)), strict=True
    ):
        cv2.circle(picture, (x, y), 7, colour, -1, cv2.LINE_AA)
    yuv = cv2.cvtColor(cv2.GaussianBlur(picture, (0, 0), 0.7), cv2.COLOR_RGB2YUV)
    frame = cast(Frame, SimpleNamespace(luma=yuv[..., 0], yuv=lambda: yuv))
    boxes = StartBoxes(0, {name: Box.around(at, 20.0) for name, at in zip(NAMES, places, strict=True)})

    grey = Grey.of_boxes(frame, boxes, NAMES).of(frame)
    assert stands_out(grey, boxes.centres_px(NAMES), boxes.sides_px(NAMES)).all()


@pytest.mark.parametrize("seed", range(4))
def test_dots_of_two_sizes_keep_their_own(seed: int) -> None:
    random = np.random.default_rng(seed)
    places = np.arange(7)[:, None] * [60.0, 0.0] + [50.0, 60.0] + random.uniform(-2, 2, (7, 2))
    diameters = random.uniform(10, 13) * np.where(np.arange(7) < 2, random.uniform(1.5, 2.2), 1.0)
    luma = np.full((480, 1900), 60, np.uint8)
    for (x, y), diameter in zip(np.rint(4 * places + 1.5).astype(int).tolist(), diameters, strict=True):
        cv2.circle(luma, (x, y), round(2 * diameter), 220, -1)
    luma = cv2.GaussianBlur(cv2.resize(luma, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA), (0, 0), 0.7)

    tracker, first = MarkerTracker.begin(luma, places + random.uniform(-1, 1, (7, 2)), 1.3 * diameters, use_csrt=False)
    assert tracker.start.diameter_px == pytest.approx(diameters, rel=0.15)
    assert np.linalg.norm(first.position_px - places, axis=1).max() < 0.3


@pytest.mark.parametrize("turns", [0.25, *later(0.31)])
def test_dots_of_several_colours_that_whirl_about_each_other_keep_their_names(turns: float, tmp_path: Path) -> None:
    """Filmed with too few frames to follow them by their way: what tells them apart is their colour."""

    class Whirl(Clip):
        def places(self, frame: int) -> np.ndarray:
            at = super().places(frame)
            angle = 2 * np.pi * turns * max(frame - 5, 0)
            at[3:] = at[3:].mean(axis=0) + 20.0 * np.array([[-1.0], [1.0]]) * [np.cos(angle), np.sin(angle)]
            return at

    clip = Whirl(dots=(GREEN, RED, GREEN, BLUE, YELLOW), off_px=0.0)
    off = clip.off(tmp_path, frames=30)

    assert np.nanmax(off) < 5
    assert np.isfinite(off).mean() > 0.8


BLACK, DEEP = (22, 22, 26), (60, 85, 95)  # water darker than a bright body, brighter than a black dot


def test_a_black_dot_half_over_dark_water_stays_in_its_middle(tmp_path: Path) -> None:
    """As the nose on the tip of a bright body: the water is no part of the dot."""
    clip = Clip(dots=(BLACK,) * 5, body=STRIP, off_px=7.0, wall=DEEP)

    off = clip.off(tmp_path)
    assert off.max() < 0.4  # 9 to 14 px where the water counted
    assert np.sqrt((off**2).mean(axis=0)).max() < 0.25  # 0.37 with one level for body and water


@pytest.mark.parametrize("beside", [0.55, *later(0.7)])
def test_a_start_box_beside_its_dot_is_moved_onto_it_and_said(beside: float) -> None:
    clip = Clip(dots=(BLACK,) * 5, body=STRIP, off_px=5.0, wall=DEEP)
    luma, places = cv2.cvtColor(clip.frame(0), cv2.COLOR_RGB2GRAY), clip.places(0)
    centres, sides = places + np.eye(5)[:, [2]] * [0.0, beside * 16.0], np.full(5, 16.0)
    _, first = MarkerTracker.begin(luma, centres, sides, use_csrt=False)
    boxes = {name: Box.around(at, 16.0) for name, at in zip(NAMES, centres, strict=True)}
    (flag,) = doubtful_boxes(luma, StartBoxes(0, boxes), NAMES)

    assert np.linalg.norm(first.position_px - places, axis=1)[2] < 0.5
    assert flag.markers == ("tail_1",)
    assert "beside a dot like the other markers" in flag.message
    right = {name: Box.around(at, 16.0) for name, at in zip(NAMES, places, strict=True)}
    assert not doubtful_boxes(luma, StartBoxes(0, right), NAMES)


@pytest.mark.parametrize("beside", [1.0, *later(0.9, 1.1)])
def test_a_start_box_between_two_dots_goes_to_the_nearer_one(beside: float) -> None:
    clip = Clip(dots=(BLACK,) * 5, body=STRIP)
    luma, places = cv2.cvtColor(clip.frame(0), cv2.COLOR_RGB2GRAY), clip.places(0)
    centres = places.copy()
    centres[2, 0] += beside * 16.0
    _, first = MarkerTracker.begin(luma, centres, np.full(5, 16.0), use_csrt=False)

    assert np.linalg.norm(first.position_px - places, axis=1).max() < 0.5
    boxes = StartBoxes(0, {name: Box.around(at, 16.0) for name, at in zip(NAMES, centres, strict=True)})
    assert "beside a dot like the other markers" in " ".join(f.message for f in doubtful_boxes(luma, boxes, NAMES))


def test_white_bubbles_are_no_red_dots(tmp_path: Path) -> None:
    clip = Clip(dots=((225, 60, 30),) * 5, off_px=7.0, wall=(45, 80, 120), bubbles=7)
    off = clip.off(tmp_path)

    assert np.nanmax(off) < 8  # half a dot: a bubble may hide some of it
    assert (off < 5).mean() > 0.95  # 0.6 by brightness


def test_a_robot_of_which_two_markers_stay_lost_is_looked_for_anew(tmp_path: Path) -> None:
    clip = Clip(dots=((235, 235, 235),) * 5, off_px=7.0, hidden=range(10, 45))
    asked = []

    def find(frame: Frame) -> StartBoxes | None:
        """Find the robot at the second attempt, with two names the other way round."""
        asked.append(frame.number)
        places = clip.places(frame.number)[[1, 0, 2, 3, 4]]
        return StartBoxes(frame.number, dict(zip(NAMES, (Box.around(at, 16.0) for at in places), strict=True)))

    tracked = clip.tracked(tmp_path, 40, lambda frame: find(frame) if frame.number > 20 else asked.append(frame.number))
    places = tracked.position.transpose("time", "keypoint", "space").values
    off = places[25:29, :2] - clip.places(25)[[1, 0]]

    assert asked[:2] == [20, 25]  # in vain each time after half as many frames more
    assert np.linalg.norm(off, axis=2).max() < 4.0
    assert np.isnan(places[12:25, :2]).all()  # names that were elsewhere while in doubt
    assert np.isfinite(places[12:25, 2]).all()


def test_a_second_robot_is_not_taken_for_the_first_while_most_of_it_is_followed(tmp_path: Path) -> None:
    """Where two markers are covered the robot is looked for, and only the other one is whole."""
    clip, asked = Clip(dots=((235, 235, 235),) * 5, off_px=7.0, hidden=range(10, 30)), []

    def find(frame: Frame) -> StartBoxes:
        asked.append(frame.number)
        places = clip.places(0) + np.array([0.0, 100.0])
        return StartBoxes(frame.number, dict(zip(NAMES, (Box.around(at, 16.0) for at in places), strict=True)))

    off = clip.off(tmp_path, 40, find)
    assert asked
    assert np.nanmax(off) < 2.0
    assert np.isfinite(off[:, :3]).all()


@pytest.mark.parametrize(
    ("order", "taken"), [((0, 1, 2, 4, 3), True), ((0, 1, 2, 3, 4), False), ((1, 2, 0, 3, 4), False)]
)
def test_once_a_cover_is_gone_names_are_set_right_where_most_stay(
    order: tuple[int, ...], taken: bool, tmp_path: Path
) -> None:
    clip = Clip(dots=((235, 235, 235),) * 5, off_px=7.0, hidden=range(10, 18))
    asked = []

    def find(frame: Frame) -> StartBoxes:
        asked.append(frame.number)
        places = clip.places(frame.number)[list(order)]
        return StartBoxes(frame.number, dict(zip(NAMES, (Box.around(at, 16.0) for at in places), strict=True)))

    tracked = clip.tracked(tmp_path, 40, find)
    places = tracked.position.transpose("time", "keypoint", "space").values[30:36]
    true = np.array([clip.places(frame) for frame in range(30, 36)])[:, list(order) if taken else slice(None)]

    assert 20 <= asked[0] <= 28
    assert np.linalg.norm(places - true, axis=2).max() < 4.0


@pytest.mark.parametrize("to", [0.6, *later(1.5)])
@pytest.mark.parametrize("box", [0.7, *later(1.4)])
def test_dots_that_shrink_or_grow_are_measured_in_their_middle(to: float, box: float, tmp_path: Path) -> None:
    clip = Clip(dots=((235, 235, 235),) * 5, off_px=0.0, diameter_px=lambda k: 12 * (1 + (to - 1) * k / 45), box=box)

    assert clip.off(tmp_path, 36).max() < 0.5


@pytest.mark.parametrize("turned", [*later(False), True])
def test_from_sun_into_shade_and_back_the_dots_count(turned: bool, tmp_path: Path) -> None:
    columns = np.arange(SIZE[0])

    def light(frame: int) -> np.ndarray:
        share = 0.35 + 0.65 / (1 + np.exp((columns - 330 + 4 * frame) / 8))
        return share[::-1] if turned else share

    off = Clip(dots=((235, 235, 235),) * 5, off_px=0.0, light=light).off(tmp_path)
    assert np.nanmax(off) < 3
    assert np.isfinite(off).mean() > 0.98


def test_brightness_is_used_where_it_separates_the_dots(tmp_path: Path) -> None:
    clips = {True: Clip(), False: Clip(dots=((235, 235, 235),) * 5, off_px=0.0)}
    for by_colour, clip in clips.items():
        with VideoWriter(tmp_path / "clip.mp4", *SIZE, fps=30) as writer:
            writer.write(clip.frame(0))
        with Video(tmp_path / "clip.mp4") as video:
            grey = Grey.chosen(video.frame(0), clip.places(0), np.full(5, 16.0))
        assert grey.by_colour is by_colour
        assert Grey.restored(grey.as_array()) == grey


@pytest.mark.long
def test_one_dot_of_another_colour_is_told_by_its_brightness(tmp_path: Path) -> None:
    purple, pale = (210, 90, 210), (205, 205, 205)  # the former as bright as the wall, the latter as grey
    clip = Clip(dots=(purple, purple, pale, purple, purple), body=WALL, off_px=0.0)

    assert clip.off(tmp_path).max() < 0.6


@pytest.mark.long
def test_a_pale_bar_over_a_white_dot_is_not_taken_for_it(tmp_path: Path) -> None:
    clip = Clip(dots=((235, 235, 235),) * 5, off_px=0.0, diameter_px=lambda _: 12.0, speed_px=1.5, bar_px=(215, 239))
    tracked = clip.tracked(tmp_path, 60)
    place = tracked.position.transpose("time", "keypoint", "space").values
    off = np.linalg.norm(place - [clip.places(k) for k in range(60)], axis=2)

    assert not ((off > 12) & (tracked.confidence.values > 0.35)).any()
    x = np.array([clip.places(k)[:, 0] for k in range(60)])
    clear = (x < 200) | (x > 275)  # a second behind the bar at the latest
    assert (off[clear] < 1.0).mean() > 0.97


@pytest.mark.long
def test_a_robot_that_comes_into_view_is_tracked_from_where_each_marker_does(tmp_path: Path) -> None:
    clip = Clip(dots=((235, 235, 235),) * 5, off_px=0.0, start_px=-180.0, speed_px=5.0, boxes_in=40)
    off = clip.off(tmp_path, 60)
    x = np.array([clip.places(k)[:, 0] for k in range(60)])

    assert np.nanmax(off[(x > 8) & (x < SIZE[0] - 8)]) < 1.0
    assert np.isfinite(off[(x > 14) & (x < SIZE[0] - 14)]).mean() > 0.99


def test_of_coloured_dots_the_hidden_one_is_named(tmp_path: Path) -> None:
    clip = Clip()
    with VideoWriter(tmp_path / "clip.mp4", *SIZE, fps=30, crf=18) as writer:
        writer.write(clip.frame(0))
    boxes = {**clip.boxes().boxes, "tail_3": Box.around((330.0, 60.0), 16.0)}
    with Video(tmp_path / "clip.mp4") as video, pytest.raises(InputError) as refused:
        follow_video(video, StartBoxes(0, boxes), NAMES)

    assert "found tail_3;" in str(refused.value)
