"""The viewer itself, without a window: it draws the video and what lies over it, and complains of nothing."""

import io
import shutil
import socket
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from rerun.experimental import View, ViewerClient

from reports.recorded_trial import TWIN
from reports.recording import write_recording
from tests.reports.recording.trials import BODY, HEIGHT_PX, MARKERS, SIDE_PX, WATER, WIDTH_PX, trial_with_video

pytestmark = pytest.mark.long
PATIENCE_S = 30.0
CHROMIUM = Path("/usr/lib/chromium")  # where Debian keeps it


@pytest.fixture
def viewer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ViewerClient]:
    """A viewer without a window, drawing with the machine's graphics or else with the software of a Chromium."""
    _draw_with_software(tmp_path, monkeypatch)
    executable = shutil.which("rerun", path=str(Path(sys.executable).parent)) or shutil.which("rerun")
    if executable is None:
        pytest.skip("no Rerun viewer next to this Python or on the path")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    try:
        client = ViewerClient.spawn(headless=True, port=port, hide_welcome_screen=True, executable_path=executable)
    except (RuntimeError, OSError) as error:
        pytest.skip(f"the viewer does not start without a window here: {error}")
    with client:
        yield client


def _draw_with_software(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets Vulkan find the software renderer that comes with Chromium, where there is one."""
    loader, driver = CHROMIUM / "libvulkan.so.1", CHROMIUM / "vk_swiftshader_icd.json"
    if loader.exists() and driver.exists():
        (folder / "vulkan").mkdir()
        (folder / "vulkan" / loader.name).symlink_to(loader)
        monkeypatch.setenv("LD_LIBRARY_PATH", str(folder / "vulkan"))
        monkeypatch.setenv("VK_DRIVER_FILES", str(driver))
        monkeypatch.setenv("WGPU_BACKEND", "vulkan")


def test_viewer_draws_the_video_and_what_lies_over_it(viewer: ViewerClient, tmp_path: Path) -> None:
    trial = replace(trial_with_video(tmp_path, 2 * HEIGHT_PX), name="shown")
    write_recording(tmp_path / "session.rrd", [trial])
    viewer.open(str(tmp_path / "session.rrd"))
    views = views_of(viewer)
    assert {view.view_class for view in views} >= {"2D", "TimeSeries", "StateTimeline", "TextLog"}
    viewer.set_time("frame", sequence=12, play_state="paused")
    (picture,) = (view for view in views if view.view_class == "2D")
    shares = {}
    for _ in range(int(PATIENCE_S)):
        image = matplotlib.image.imread(io.BytesIO(viewer.take_screenshot(picture.view_id)))[..., :3]
        shares = {name: share_of(image, colour) for name, colour in (("water", WATER), ("body", BODY), ("twin", TWIN))}
        if all(shares.values()):
            break
        time.sleep(1.0)
    markers = len(MARKERS) * SIDE_PX**2 / (WIDTH_PX * HEIGHT_PX)
    assert shares["water"] > 0.3, "the picture takes less than its half of the view"
    assert 0.6 * markers < shares["body"] / shares["water"] < 1.1 * markers, "some of it lies under boxes and labels"
    assert shares["twin"] * image[..., 0].size > 10 * len(MARKERS), "pixels of dots 9 points wide"
    assert [view for view in views_of(viewer) if view.reports] == []


def views_of(viewer: ViewerClient) -> list[View]:
    """The views, once the recording is open."""
    state = viewer.get_state()
    for _ in range(int(PATIENCE_S)):
        if state.views and not state.loading:
            break
        time.sleep(1.0)
        state = viewer.get_state()
    return list(state.views)


def share_of(image: np.ndarray, colour: tuple[int, int, int]) -> float:
    """The share of an (h, w, 3) image, 0 to 1, that is nearly of a colour."""
    return float((np.abs(255 * image - np.array(colour)).max(axis=2) < 16).mean())
