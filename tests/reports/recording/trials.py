"""Small trials with everything a recording can show, and a video to go with them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.video.writer import VideoWriter
from reports.recorded_trial import RecordedTrial
from reports.recording import make_proxy
from swimcal.flags import Flag
from swimcal.tracks import as_tracks
from tracking.tracked import SampleState, with_states

MARKERS = ("nose", "neck", "tail_1", "caudal_fin")
FRAMES = 48
WIDTH_PX, HEIGHT_PX = 320, 180
SIDE_PX = 21
WATER, BODY = (40, 70, 80), (250, 140, 40)
LOST = slice(20, 26)  # frames in which the last marker is missing


def frame_times_s(frames: int = FRAMES) -> np.ndarray:
    """A variable rate: every second frame comes 4 ms late."""
    time_s = np.arange(frames) / 60
    time_s[1::2] += 0.004
    return time_s


def positions_px(frames: int = FRAMES) -> np.ndarray:
    """(n, m, 2) whole pixels, so that a square of an odd side has its centre there."""
    along = np.linspace(40, 250, len(MARKERS))
    x = along + np.arange(frames)[:, None]
    y = 90 + np.linspace(0, 40, len(MARKERS)) * np.sin(0.3 * np.arange(frames))[:, None]
    return np.round(np.stack([x, y], axis=2))


def made_trial(name: str = "f1_00", **changes: Any) -> RecordedTrial:
    """A trial in which one marker is lost for a while, another carried on, with a twin a little off."""
    position_px = positions_px()
    state = np.full(position_px.shape[:2], SampleState.MEASURED, dtype=np.int8)
    state[LOST, 3], state[30:34, 2] = SampleState.MISSING, SampleState.PREDICTED
    twin_px = position_px + np.array([3.0, -2.0])
    twin_px[:2] = np.nan
    missing = state == SampleState.MISSING
    position_px[missing] = np.nan
    confidence = np.where(missing, 0.0, np.linspace(0.4, 1.0, state.size).reshape(state.shape))
    size_px = np.where(state == SampleState.MEASURED, float(SIDE_PX), np.nan)
    flags = (
        Flag("gap", ("caudal_fin",), (20, 25), "6 samples are missing"),
        Flag("scale_off_robot", (), None, "far off"),
    )
    tracked = with_states(as_tracks(MARKERS, frame_times_s(), position_px, confidence), state, size_px, flags)
    residual_mm = np.where(missing, np.nan, 1.5 + np.arange(state.size).reshape(state.shape))
    whole = RecordedTrial(name, tracked, None, (WIDTH_PX, HEIGHT_PX), twin_px, residual_mm, {"marker_error_mm": 3.125})
    return replace(whole, **changes)


def write_video(path: Path, size_px: tuple[int, int] = (WIDTH_PX, HEIGHT_PX)) -> Path:
    """A video of squares where the markers are, stretched to a size."""
    scale = size_px[0] // WIDTH_PX
    with VideoWriter(path, *size_px, preset="ultrafast", crf=10) as writer:
        for centres, time_s in zip(positions_px().astype(int), frame_times_s(), strict=True):
            image = np.full((HEIGHT_PX, WIDTH_PX, 3), WATER, np.uint8)
            for x, y in centres:
                half = SIDE_PX // 2
                image[y - half : y + half + 1, x - half : x + half + 1] = BODY
            writer.write(image.repeat(scale, axis=0).repeat(scale, axis=1), float(time_s))
    return path


def trial_with_video(folder: Path, max_height_px: int = HEIGHT_PX // 2) -> RecordedTrial:
    """A trial with a proxy, by default of 156 x 88 pixels, about half its picture; the video has twice its pixels."""
    video = write_video(folder / "video.mp4", (2 * WIDTH_PX, 2 * HEIGHT_PX))
    make_proxy(video, folder / "proxy.mp4", max_height_px)
    return made_trial(video_proxy=folder / "proxy.mp4")
