"""Recording of a session for the Rerun viewer: a small copy of the video, the layers in its picture, and the layout.

`write_recording` writes and checks the file, with the layers of every trial (`reports.recorded_trial`) and the layout
of `blueprint_of`. `make_proxy` makes the copy of a video that it embeds.
"""

import os
import warnings
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple, cast

import av
import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import RrdReader
from rerun.error_utils import RerunWarning

from reports.recorded_trial import (
    CONFIDENCE,
    FLAGS,
    FRAME,
    MISSING_FORCE,
    MISSING_TORQUE,
    RESIDUAL,
    STATE_COLOURS,
    STATES,
    SUMMARY,
    TIME,
    TWIN,
    WARN,
    Layer,
    RecordedTrial,
    entity_of,
    marker_colour,
    missing_layers,
    series_layers,
)
from reports.words import listed
from swimcal.errors import Fault, InputError
from swimcal.results import writing_whole
from swimcal.tracks import pixels_of
from tracking.video import Video

# The copy of the video
CODEC = "libsvtav1"
# Preset 9 kept moving markers within 0.15 px of their place, 10 within 0.7; no filter that mixes pictures.
OPTIONS = {"preset": "9", "crf": "30", "svtav1-params": "enable-tf=0"}
GROUP = 30  # frames from one key frame to the next: few, so that the viewer can jump
# The height is a multiple of this: the viewer (Rerun 0.41) shifts the colours of a picture of another height.
STEP_PX = 4
TICKS = 90_000  # ticks of the time stamps in a second

Progress = Callable[[int], None]

# Layers of the picture
PICTURE = "picture"
# Negative radii are in points of the screen, whatever the zoom.
LINE = -1.5
FINE = -0.75
DOT = -3.0
RING = -4.5

# The recording
TRAIL_S = 0.5  # time up to now of which trails are shown
APPLICATION = "swimcal"


# The copy of the video.


def make_proxy(video: Path, out: Path, max_height_px: int = 720, progress: Progress | None = None) -> int:
    """Make a small AV1 copy of a video in MP4, upright, for `RecordedTrial.video_proxy`.

    AV1, because the Rerun viewer decodes it by itself in its window and in the browser; for H.264 its window needs an
    FFmpeg of the user's. Time stamps are those of the video, variable ones too, counted from the first frame. Of a
    damaged file the frames that can be read are kept.

    Args:
        video: a file that `tracking.video.Video` reads.
        out: the copy, ending in ``.mp4``; written whole or not at all.
        max_height_px: largest height of the copy. A smaller video keeps its size, made a multiple of 4 high and even
            wide.
        progress: called after each frame with the number of frames done.

    Returns:
        The number of frames.

    Raises:
        InputError: the video cannot be read.
        ResultsNotWritable: the copy cannot be written.
    """
    os.environ.setdefault("SVT_LOG", "1")  # errors alone: the encoder's messages go past Python to the terminal
    done = 0
    with Video(video) as source, writing_whole(out) as part, av.open(str(part), "w") as sink:
        info = source.info
        height_px = max(min(info.height_px, max_height_px) // STEP_PX, 1) * STEP_PX
        width_px = max(round(info.width_px * height_px / info.height_px / 2) * 2, 2)
        rate = Fraction(info.fps).limit_denominator(1001) if info.frames > 1 else 60
        encoder = cast(av.VideoStream, sink.add_stream(CODEC, rate=rate, options=OPTIONS))
        encoder.width, encoder.height, encoder.pix_fmt = width_px, height_px, "yuv420p"
        encoder.codec_context.time_base = Fraction(1, TICKS)
        encoder.codec_context.gop_size = GROUP
        for done, frame in enumerate(source.frames(), 1):
            small = frame.scaled(width_px, height_px)
            small.pts, small.time_base, small.pict_type = round(frame.time_s * TICKS), Fraction(1, TICKS), 0
            sink.mux(encoder.encode(small))
            if done == 1:
                _yield_the_machine()
            if progress:
                progress(done)
        sink.mux(encoder.encode(None))
    return done


def _yield_the_machine() -> None:
    """Give back the real-time priority that SVT-AV1 takes where it may (as root): it froze everything else."""
    tasks = Path("/proc/self/task")
    for task in tasks.iterdir() if tasks.exists() else ():
        with suppress(OSError):  # a thread that has ended
            if os.sched_getscheduler(int(task.name)) == os.SCHED_FIFO:
                os.sched_setscheduler(int(task.name), os.SCHED_OTHER, os.sched_param(0))


# The layers of the picture.


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


def nearest(stamps: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Find the (n,) index of the stamp nearest each of the n times; both increase."""
    right = np.searchsorted(stamps, times).clip(1, max(len(stamps) - 1, 1))
    left_is_nearer = times - stamps[right - 1] <= stamps[right.clip(max=len(stamps) - 1)] - times
    return np.where(left_is_nearer, right - 1, right).clip(max=len(stamps) - 1)


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


# The layout.


def blueprint_of(trials: Sequence[RecordedTrial]) -> rrb.Blueprint:
    """Make the layout for these trials, with the time of the video as the timeline."""
    tabs = [rrb.Horizontal(_picture(trial), _series(trial), column_shares=[3, 2], name=trial.name) for trial in trials]
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIME, play_state="paused"),
    )


def _picture(trial: RecordedTrial) -> rrb.Spatial2DView:
    bounds = None
    if trial.picture_px is not None:
        width, height = trial.picture_px
        bounds = rrb.VisualBounds2D(x_range=[-0.5, width - 0.5], y_range=[-0.5, height - 0.5])
    frame_s = float(np.median(np.diff(trial.time_s))) if len(trial.time_s) > 1 else TRAIL_S
    trails: Any = {picture_entity(trial, "trails"): _last(TRAIL_S, max(round(TRAIL_S / frame_s), 1))}
    return rrb.Spatial2DView(
        origin=picture_entity(trial), name=f"{trial.name}: picture", visual_bounds=bounds, overrides=trails
    )


def _series(trial: RecordedTrial) -> rrb.Vertical:
    shares: dict[rrb.View | rrb.Container, float] = {}
    if trial.residual_mm is not None:
        shares[_lines(trial, RESIDUAL, "residual to the twin, mm")] = 2.0
    if trial.missing is not None:
        torques = _lines(trial, MISSING_TORQUE, "missing torque, mN m", legend=True)
        forces = _lines(trial, MISSING_FORCE, "missing force, mN", legend=True)
        shares[rrb.Tabs(torques, forces, active_tab=0)] = 2.0
    shares[_lines(trial, CONFIDENCE, "confidence", axis_y=rrb.ScalarAxis(range=(-0.02, 1.02)))] = 1.5
    shares[rrb.StateTimelineView(origin=entity_of(trial.name, STATES), name="state of each sample")] = 3.0
    words: list[rrb.View] = [rrb.TextDocumentView(origin=entity_of(trial.name, SUMMARY), name="numbers")]
    if trial.tracked.flags:
        words.insert(0, rrb.TextLogView(origin=entity_of(trial.name, FLAGS), name="flags"))
    shares[rrb.Tabs(*words, active_tab=0)] = 1.5
    return rrb.Vertical(*shares, row_shares=list(shares.values()))


def _lines(
    trial: RecordedTrial, entity: str, name: str, axis_y: rrb.ScalarAxis | None = None, *, legend: bool = False
) -> rrb.TimeSeriesView:
    """Make a plot of lines; markers need no legend, as the picture has their names in the same colours."""
    shown = rrb.PlotLegend(visible=legend)
    return rrb.TimeSeriesView(origin=entity_of(trial.name, entity), name=name, axis_y=axis_y, plot_legend=shown)


def _last(seconds: float, frames: int) -> rrb.VisibleTimeRanges:
    """Select what happened in the last seconds, or frames, up to the time shown."""
    boundary = rrb.TimeRangeBoundary
    now = boundary.cursor_relative()
    return rrb.VisibleTimeRanges(
        [
            rr.encodings.VisibleTimeRange(TIME, start=boundary.cursor_relative(seconds=-seconds), end=now),
            rr.encodings.VisibleTimeRange(FRAME, start=boundary.cursor_relative(seq=-frames), end=now),
        ]
    )


# The file.


def write_recording(path: Path, trials: Sequence[RecordedTrial], name: str = "swimcal") -> None:
    """Write a recording for the Rerun viewer, read it back, and only then give it its name.

    Each trial has its own tree of entities ``/<trial>/…`` on two timelines, ``frame`` (its number, from 0) and
    ``time`` (that of the video), both from the start of the trial:

    - ``picture``: in pixels of the video; ``video``, ``boxes`` (colour: state of the sample), ``markers``,
      ``trails``, ``twin`` and ``residuals`` (lines from the measured to the twin's marker);
    - ``picture/missing_force``, ``missing_force_mN`` and ``missing_torque_mN_m``, once there is a diagnosis: the force
      that is missing on the head as an arrow, and a line for each of head and hinges;
    - ``confidence`` and ``residual_mm``: a line for each marker;
    - ``states/<number>_<marker>``: the frames at which the state changes;
    - ``flags``: a log, each flag at its first frame; ``summary``: the trial's numbers.

    Args:
        path: the file, ending in ``.rrd``.
        trials: the trials to show.
        name: the name that the viewer shows, such as that of the session.

    Raises:
        ResultsNotWritable: the file cannot be written; the previous one is unchanged.
        InputError: what was written cannot be read back whole.
    """
    layers = {trial.name: trial_layers(trial) for trial in trials}
    with writing_whole(path) as part:
        stream = rr.RecordingStream(APPLICATION)
        stream.save(part, default_blueprint=blueprint_of(trials))
        stream.send_recording_name(name)
        for trial in trials:
            for layer in layers[trial.name]:
                layer.send(stream, trial.time_s)
        stream.flush()
        stream.disconnect()
        check_recording(part, [layer.entity for of_trial in layers.values() for layer in of_trial])


def trial_layers(trial: RecordedTrial) -> list[Layer]:
    """Make every layer of a trial."""
    layers = [*picture_layers(trial), *series_layers(trial)]
    if trial.missing is not None:
        head_px = (pixels_of(trial.tracked)[:, trial.markers.index(name)] for name in ("nose", "neck"))
        layers += missing_layers(trial.name, trial.missing, *head_px)
    return layers


def check_recording(path: Path, entities: Collection[str]) -> None:
    """Check, without a viewer, that a recording is whole and holds these entities and a layout.

    Rerun does not report a file that it could not write whole, and only warns of one that breaks off.

    Raises:
        InputError: it cannot be read, or something is missing.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RerunWarning)
            reader = RrdReader(path)
            held = {chunk.entity_path for chunk in reader.stream()}
            missing = [*sorted(set(entities) - held), *([] if reader.blueprints() else ["its layout"])]
            found = f"nothing of {listed(missing)}" if missing else ""
    except (OSError, ValueError, RuntimeError, RerunWarning) as error:
        found = str(error)
    if found:
        expected, again = "a whole recording of Rerun", "Make it again with `calib view`."
        raise InputError([Fault(str(path), "", "cannot be read back", found, expected, next_step=again)])
