"""A proxy shows the same pictures at the same times, in fewer pixels."""

from pathlib import Path

import av
import numpy as np
import pytest

from reports.recording import make_proxy
from tests.reports.recording.trials import BODY, FRAMES, HEIGHT_PX, WIDTH_PX, frame_times_s, positions_px, write_video


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
