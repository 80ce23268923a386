"""The layers of the picture: video, boxes, markers and their trails, the twin and the residuals to it."""

from pathlib import Path
from typing import Any, NamedTuple

import av
import numpy as np
import rerun as rr

from reports.recording.layer import STATE_COLOURS, TWIN, WARN, Layer, entity_of, marker_colour
from reports.recording.recorded_trial import RecordedTrial
from session import InputError
from session.errors import Fault
from session.tracks import pixels_of

PICTURE = "picture"
# Negative radii are in points of the screen, whatever the zoom.
LINE = -1.5
FINE = -0.75
DOT = -3.0
RING = -4.5


def picture_layers(trial: RecordedTrial) -> list[Layer]:
    """Make the layers of the picture, in pixels of the trial's video; what the trial has no data for is left out."""
    layers = [_context(trial)]
    if trial.video_proxy is not None and trial.picture_px is not None:
        layers.append(_video(trial, trial.video_proxy, trial.picture_px))
    if np.isfinite(trial.tracked["size"].values).any():
        layers.append(_boxes(trial))
    layers += [_trails(trial), _markers(trial)]
    if trial.twin_px is not None:
        layers += [_residual_lines(trial, trial.twin_px), _twin(trial, trial.twin_px)]
    return layers


def picture_entity(trial: RecordedTrial, *parts: str) -> str:
    """Return the path of a part of the picture."""
    return entity_of(trial.name, PICTURE, *parts)


def _context(trial: RecordedTrial) -> Layer:
    """Make the layer of name and colour of each marker, which other layers refer to by the marker's index."""
    classes = [(k, marker, marker_colour(k)) for k, marker in enumerate(trial.markers)]
    return Layer(picture_entity(trial), (rr.AnnotationContext(classes),))


def _video(trial: RecordedTrial, file: Path, picture_px: tuple[int, int]) -> Layer:
    """Make the layer of the proxy, stretched to the size of the video; each frame shows the picture nearest in time.

    Rerun puts the corner of the top left pixel at (0, 0), the tracks its centre: hence the half pixel.
    """
    proxy = _open_proxy(file)
    shown_ns = proxy.stamps_ns[nearest(1e-9 * (proxy.stamps_ns - proxy.stamps_ns[0]), trial.time_s)]
    scale = [picture_px[0] / proxy.width_px, picture_px[1] / proxy.height_px, 1.0]
    place = rr.Transform3D(translation=[-0.5, -0.5, 0.0], scale=scale)
    columns = rr.VideoFrameReference.columns_nanos(shown_ns)
    return Layer(picture_entity(trial, "video"), (proxy.asset, place), _all_rows(trial), tuple(columns))


class _Proxy(NamedTuple):
    """A proxy's content, the (n,) sorted time stamps of its pictures, and their size."""

    asset: rr.AssetVideo
    stamps_ns: np.ndarray
    width_px: int
    height_px: int


def _open_proxy(file: Path) -> _Proxy:
    try:
        asset = rr.AssetVideo(path=file)
        stamps_ns = np.sort(asset.read_frame_timestamps_nanos())
        with av.open(str(file)) as container:
            stream = container.streams.video[0]
            return _Proxy(asset, stamps_ns, stream.width, stream.height)
    except (OSError, RuntimeError, ValueError) as error:
        again = "Make it again with `calib view`."
        fault = Fault(str(file), "", "no video to show", str(error), "an MP4 made by `make_proxy`", next_step=again)
        raise InputError([fault]) from error


def nearest(stamps: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Find the (n,) index of the stamp nearest each of the n times; both increase."""
    right = np.searchsorted(stamps, times).clip(1, max(len(stamps) - 1, 1))
    left_is_nearer = times - stamps[right - 1] <= stamps[right.clip(max=len(stamps) - 1)] - times
    return np.where(left_is_nearer, right - 1, right).clip(max=len(stamps) - 1)


def _boxes(trial: RecordedTrial) -> Layer:
    """Make the layer of boxes as wide as the markers appear, in the colour of the sample's state.

    Where the size was not measured, the marker's median is used.
    """
    size = trial.tracked["size"].values
    measured = np.isfinite(size).any(axis=0)  # (m,)
    usual = np.array([np.nanmedian(size[:, k]) if measured[k] else np.nan for k in range(size.shape[1])])
    size = np.where(np.isfinite(size), size, usual)  # (n, m)
    good = trial.present & np.isfinite(size)
    half = np.repeat(0.5 * size[good][:, None], 2, axis=1)  # (k, 2)
    centres, states = pixels_of(trial.tracked)[good], trial.tracked.state.values[good]
    columns = rr.Boxes2D.columns(centers=centres, half_sizes=half, class_ids=states).partition(good.sum(axis=1))
    names = rr.AnnotationContext([(int(state), state.word, colour) for state, colour in STATE_COLOURS.items()])
    style = rr.Boxes2D.from_fields(radii=FINE, show_labels=False)
    return Layer(picture_entity(trial, "boxes"), (names, style), _all_rows(trial), tuple(columns))


def _markers(trial: RecordedTrial) -> Layer:
    good = trial.present
    columns = rr.Points2D.columns(positions=pixels_of(trial.tracked)[good], class_ids=np.nonzero(good)[1])
    style = rr.Points2D.from_fields(radii=DOT, show_labels=True)
    return _make_ragged(trial, "markers", style, columns, good)


def _trails(trial: RecordedTrial) -> Layer:
    """Make the layer of each marker's step since the frame before.

    The blueprint shows the steps of the last half second.
    """
    position_px = pixels_of(trial.tracked)
    before = np.concatenate([np.full_like(position_px[:1], np.nan), position_px[:-1]])
    good = trial.present & np.isfinite(before).all(axis=2)
    steps = np.stack([before, position_px], axis=2)[good]  # (k, 2, 2)
    columns = rr.LineStrips2D.columns(strips=steps, class_ids=np.nonzero(good)[1])
    return _make_ragged(trial, "trails", rr.LineStrips2D.from_fields(radii=LINE, show_labels=False), columns, good)


def _twin(trial: RecordedTrial, twin_px: np.ndarray) -> Layer:
    good = np.isfinite(twin_px).all(axis=2)
    style = rr.Points2D.from_fields(radii=RING, colors=[TWIN], show_labels=False, draw_order=25.0)
    return _make_ragged(trial, "twin", style, rr.Points2D.columns(positions=twin_px[good]), good)


def _residual_lines(trial: RecordedTrial, twin_px: np.ndarray) -> Layer:
    good = trial.present & np.isfinite(twin_px).all(axis=2)
    lines = np.stack([pixels_of(trial.tracked), twin_px], axis=2)[good]  # (k, 2, 2)
    style = rr.LineStrips2D.from_fields(radii=FINE, colors=[WARN], show_labels=False)
    return _make_ragged(trial, "residuals", style, rr.LineStrips2D.columns(strips=lines), good)


def _make_ragged(trial: RecordedTrial, name: str, style: Any, columns: Any, good: np.ndarray) -> Layer:
    """Make a layer with, in each frame, as many instances as samples are `good` (n, m)."""
    columns = tuple(columns.partition(good.sum(axis=1)))
    return Layer(picture_entity(trial, name), (style,), _all_rows(trial), columns)


def _all_rows(trial: RecordedTrial) -> np.ndarray:
    return np.arange(len(trial.time_s))
