"""A recording holds what it was given, frame by frame, and one that does not fails its check."""

import re
from pathlib import Path

import av
import numpy as np
import pytest

from reports.recorded_trial import LONGEST, MissingOverTime, RecordedTrial, arrows_px
from reports.recording import check_recording, make_proxy, write_recording
from swimcal.errors import InputError
from swimcal.robot import load_robot
from swimcal.tracks import pixels_of
from tests.reports.diagnoses import JOINTS, made_forces
from tests.reports.recording.contents import EntityContents, read_recording, rows_of
from tests.reports.recording.trials import (
    BODY,
    FRAMES,
    HEIGHT_PX,
    LOST,
    MARKERS,
    SIDE_PX,
    WIDTH_PX,
    frame_times_s,
    made_trial,
    positions_px,
    trial_with_video,
    write_video,
)
from tests.reports.sample import made_trial as made_swim
from tracking.tracked import SampleState


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> RecordedTrial:
    return trial_with_video(tmp_path_factory.mktemp("video"))


@pytest.fixture(scope="module")
def file(trial: RecordedTrial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "results" / "session.rrd"
    write_recording(path, [trial, made_trial("f1 75/b", twin_px=None, residual_mm=None)], "pool")
    return path


@pytest.fixture(scope="module")
def entities(file: Path) -> dict[str, EntityContents]:
    return dict(read_recording(file).entities)


def test_every_row_stands_on_both_timelines(entities: dict[str, EntityContents]) -> None:
    layers = ("video", "boxes", "markers", "trails", "twin", "residuals")
    for entity in [*(f"/f1_00/picture/{layer}" for layer in layers), "/f1_00/confidence", "/f1_00/residual_mm"]:
        np.testing.assert_array_equal(entities[entity].frame, np.arange(FRAMES), err_msg=entity)
        np.testing.assert_allclose(entities[entity].time_s, frame_times_s(), atol=1e-9, err_msg=entity)


def test_markers_stand_where_the_tracks_have_them(trial: RecordedTrial, entities: dict[str, EntityContents]) -> None:
    markers = entities["/f1_00/picture/markers"]
    positions, classes = rows_of(markers, "Points2D:positions"), rows_of(markers, "Points2D:class_ids")
    for k in range(FRAMES):
        here = np.flatnonzero(trial.present[k])
        np.testing.assert_array_equal(classes[k], here)
        np.testing.assert_allclose(positions[k], pixels_of(trial.tracked)[k, here], atol=1e-4)
    assert [len(row) for row in positions[LOST]] == [len(MARKERS) - 1] * 6


def test_marker_names_and_colours_are_reported_once(entities: dict[str, EntityContents]) -> None:
    (context,) = rows_of(entities["/f1_00/picture"], "AnnotationContext:context")
    infos = [entry["class_description"]["info"] for entry in context[0]]
    assert [info["label"] for info in infos] == list(MARKERS)
    assert len({info["color"] for info in infos}) == len(MARKERS)


def test_boxes_have_the_size_and_the_state_of_their_samples(entities: dict[str, EntityContents]) -> None:
    boxes = entities["/f1_00/picture/boxes"]
    half, states = rows_of(boxes, "Boxes2D:half_sizes"), rows_of(boxes, "Boxes2D:class_ids")
    assert half[0] == [[SIDE_PX / 2, SIDE_PX / 2]] * len(MARKERS)
    assert half[31] == half[0], "a sample that was not measured has the usual size of its marker"
    assert states[31] == [SampleState.MEASURED, SampleState.MEASURED, SampleState.PREDICTED, SampleState.MEASURED]
    assert len(states[LOST.start]) == len(MARKERS) - 1


def test_residual_lines_go_from_the_marker_to_the_twin(
    trial: RecordedTrial, entities: dict[str, EntityContents]
) -> None:
    lines = rows_of(entities["/f1_00/picture/residuals"], "LineStrips2D:strips")
    assert lines[0] == [] == lines[1], "no twin there"
    measured, twin = np.array(lines[10]).transpose(1, 0, 2)
    np.testing.assert_allclose(measured, pixels_of(trial.tracked)[10], atol=1e-4)
    assert trial.twin_px is not None
    np.testing.assert_allclose(twin, trial.twin_px[10], atol=1e-4)
    np.testing.assert_allclose(rows_of(entities["/f1_00/picture/twin"], "Points2D:positions")[10], twin)


def test_trails_join_each_sample_to_the_one_before(trial: RecordedTrial, entities: dict[str, EntityContents]) -> None:
    steps = rows_of(entities["/f1_00/picture/trails"], "LineStrips2D:strips")
    assert steps[0] == []
    np.testing.assert_allclose(np.array(steps[5]).transpose(1, 0, 2), pixels_of(trial.tracked)[[4, 5]], atol=1e-4)
    assert len(steps[LOST.stop]) == len(MARKERS) - 1, "no step out of a gap"


@pytest.mark.parametrize("name", ["confidence", "residual_mm"])
def test_series_equal_their_inputs(trial: RecordedTrial, entities: dict[str, EntityContents], name: str) -> None:
    expected = trial.tracked.confidence.values if name == "confidence" else trial.residual_mm
    series = entities[f"/f1_00/{name}"]
    np.testing.assert_array_equal(rows_of(series, "Scalars:scalars"), expected)
    assert rows_of(series, "SeriesLines:names") == [list(MARKERS)]


def test_states_are_reported_where_they_change(entities: dict[str, EntityContents]) -> None:
    lanes = [entity for entity in entities if entity.startswith("/f1_00/states/")]
    assert sorted(lanes) == [f"/f1_00/states/{k + 1:02d}_{marker}" for k, marker in enumerate(MARKERS)]
    lost = entities["/f1_00/states/04_caudal_fin"]
    assert rows_of(lost, "StateChange:state") == [["measured"], ["missing"], ["measured"]]
    np.testing.assert_array_equal(lost.frame, [0, LOST.start, LOST.stop])


def test_flags_stand_at_their_first_frame(entities: dict[str, EntityContents]) -> None:
    flags = entities["/f1_00/flags"]
    np.testing.assert_array_equal(flags.frame, [0, 20])
    assert rows_of(flags, "TextLog:text") == [
        ["scale_off_robot · whole trial · far off"],
        ["gap · frames 20 to 25 · caudal_fin · 6 samples are missing"],
    ]


def test_summary_tells_the_metrics(entities: dict[str, EntityContents]) -> None:
    ((text,),) = rows_of(entities["/f1_00/summary"], "TextDocument:text")
    assert "| marker_error_mm | 3.125 |" in text
    assert "| samples_missing | 6 |" in text


def test_video_is_embedded_byte_for_byte(trial: RecordedTrial, entities: dict[str, EntityContents]) -> None:
    (part,) = (part for part in entities["/f1_00/picture/video"].columns["AssetVideo:blob"] if part.null_count == 0)
    assert trial.video_proxy is not None
    assert part.flatten().flatten().to_numpy().tobytes() == trial.video_proxy.read_bytes()


def test_each_frame_shows_the_picture_of_its_own_time(entities: dict[str, EntityContents]) -> None:
    stamps = rows_of(entities["/f1_00/picture/video"], "VideoFrameReference:timestamp")
    np.testing.assert_allclose(1e-9 * np.array(stamps)[:, 0], frame_times_s(), atol=1e-4)


def test_video_is_stretched_onto_the_pixels_of_the_tracks(entities: dict[str, EntityContents]) -> None:
    video = entities["/f1_00/picture/video"]
    ((scale,),) = rows_of(video, "Transform3D:scale")
    np.testing.assert_allclose(scale, [WIDTH_PX / 156, HEIGHT_PX / 88, 1.0], rtol=1e-6)
    assert rows_of(video, "Transform3D:translation") == [[[-0.5, -0.5, 0.0]]]


def test_what_a_trial_lacks_is_left_out(entities: dict[str, EntityContents]) -> None:
    other = {entity for entity in entities if not entity.startswith("/f1_00/")}
    root = r"/f1\ 75\/b"
    assert f"{root}/picture/markers" in other
    assert not other & {
        f"{root}/{name}" for name in ("picture/video", "picture/twin", "picture/residuals", "residual_mm")
    }


def test_one_that_is_not_whole_fails_its_check(tmp_path: Path, file: Path) -> None:
    whole, path = file.read_bytes(), tmp_path / "session.rrd"
    middle = len(whole) // 2
    noise = whole[:middle] + np.random.default_rng(0).bytes(4000) + whole[middle + 4000 :]
    for content in (b"", whole[: int(0.3 * len(whole))], whole[: int(0.8 * len(whole))], noise):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"session\.rrd.*cannot be read back.*calib view"):
            check_recording(path, ["/f1_00/picture/markers"])


def test_a_proxy_that_is_no_video_leaves_what_was_there(tmp_path: Path) -> None:
    proxy, path = tmp_path / "proxy.mp4", tmp_path / "session.rrd"
    proxy.write_bytes(b"not a video")
    path.write_bytes(b"before")
    with pytest.raises(InputError, match=re.escape("proxy.mp4")):
        write_recording(path, [made_trial(video_proxy=proxy)])
    assert path.read_bytes() == b"before"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["proxy.mp4", "session.rrd"]


def made_missing(along: float = 0.3, across: float = 0.0) -> MissingOverTime:
    """Nothing is known of the first two frames."""
    force = np.zeros((FRAMES, len(JOINTS)))
    force[:, 0], force[:, 1] = along, across
    force[:, -1] = 0.001 * np.arange(FRAMES)
    force[:2] = np.nan
    return MissingOverTime(JOINTS, force)


def test_every_layer_is_in_the_recording(tmp_path: Path) -> None:
    trial = made_trial(missing=made_missing())
    write_recording(tmp_path / "session.rrd", [trial])
    entities = read_recording(tmp_path / "session.rrd").entities

    vectors = rows_of(entities["/f1_00/picture/missing_force"], "Arrows2D:vectors")
    assert [len(row) for row in vectors] == [0, 0, *[1] * (FRAMES - 2)]
    torques = entities["/f1_00/missing_torque_mN_m"]
    assert rows_of(torques, "SeriesLines:names") == [list(JOINTS[2:])]
    assert rows_of(torques, "Scalars:scalars")[10][-1] == pytest.approx(10.0)
    assert rows_of(entities["/f1_00/missing_force_mN"], "SeriesLines:names") == [["head_along", "head_across"]]


@pytest.mark.parametrize(
    ("along", "across", "expected"), [(0.3, 0.0, (1, 0)), (-0.3, 0.0, (-1, 0)), (0.0, 0.3, (0, -1))]
)
def test_the_arrow_points_where_the_force_does(along: float, across: float, expected: tuple[int, int]) -> None:
    """The neck is 20 px to the right of the nose: aft is right, and left of that, seen from above, is up."""
    nose_px = np.zeros((FRAMES, 2))

    arrows = arrows_px(made_missing(along, across), nose_px, nose_px + np.array([20.0, 0.0]))

    np.testing.assert_allclose(arrows[5], 20.0 * LONGEST * np.array(expected), atol=1e-9)
    assert np.isnan(arrows[0]).all()


def test_the_force_follows_the_crank_of_the_twin() -> None:
    swim = made_swim(load_robot(), "fast")
    forces = made_forces(0.004)
    frames = len(swim.measured.time_s)

    missing = MissingOverTime.of(forces, swim, frames + 7, 5)

    assert missing is not None
    known = np.isfinite(missing.force[:, -1])
    np.testing.assert_array_equal(np.flatnonzero(known), 5 + np.flatnonzero(swim.measured.kept))
    turn = swim.phase_rad + 2 * np.pi * swim.simulated_hz * swim.measured.time_s[swim.measured.kept]
    np.testing.assert_allclose(missing.force[known, -1], 0.004 * np.cos(turn), atol=1e-12)


def test_of_a_held_out_swim_no_force_is_known() -> None:
    swim = made_swim(load_robot(), "slow")

    assert MissingOverTime.of(made_forces(), swim, 200, 0) is None


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_video(tmp_path_factory.mktemp("video") / "video.mp4", (2 * WIDTH_PX, 2 * HEIGHT_PX))


def test_it_holds_every_picture_at_its_time(video: Path, tmp_path: Path) -> None:
    seen: list[int] = []
    assert make_proxy(video, tmp_path / "proxy.mp4", HEIGHT_PX, seen.append) == FRAMES
    with av.open(str(tmp_path / "proxy.mp4")) as container:
        frames = list(container.decode(video=0))
        assert container.streams.video[0].codec_context.codec.canonical_name == "av1"
    images = [frame.to_ndarray(format="rgb24") for frame in frames]

    assert seen == list(range(1, FRAMES + 1))
    np.testing.assert_allclose([frame.time for frame in frames], frame_times_s(), atol=1e-4)
    assert images[0].shape == (HEIGHT_PX, WIDTH_PX, 3)
    for image, centres in zip(images, positions_px(), strict=True):
        found = np.argwhere(image[..., 0] > 150).mean(axis=0)[::-1]
        np.testing.assert_allclose(found, centres.mean(axis=0), atol=0.5)
    np.testing.assert_allclose(images[0][90, 40], BODY, atol=12)
    keys = [k for k, frame in enumerate(frames) if frame.key_frame]
    assert keys[0] == 0
    assert max(np.diff([*keys, FRAMES])) <= 32, "close enough to jump"
