# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From video to tracks
#
# A camera looked down on a swimming robot fish with nine round markers. This notebook follows the markers, shows what
# the tracker says of its own samples, compares it with plain CSRT and with the truth, and corrects a mistake. `calib
# track datasets/sample` does the tracking in one command.
#
# The video is rendered, so that the truth is known. Expect larger errors in real video: see `docs/tracking.md`.

# %%
import shutil
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Image

import calib

# %matplotlib inline

# %% [markdown]
# ## 1. Track
#
# The work is done on a copy of the sample, because corrections are written next to the video. Where a video has no
# start boxes, the markers are detected by the robot's layout, at any place, heading, scale and bend. A detection
# below 95 % probability is refused; then `calib track SESSION --click` writes a page on which a person clicks the
# markers.

# %%
folder = Path(tempfile.mkdtemp()) / "sample"
shutil.copytree("../datasets/sample", folder, ignore=shutil.ignore_patterns("results"))
session = calib.open_session(folder)
tracks = calib.track(session)
tracks.to_frame().round(4)

# %% [markdown]
# Look at the picture of the start boxes before you track hours of video from them.

# %%
Image(session.results / "tracking" / "f1_00_video.boxes.png", width=900)

# %% [markdown]
# The tracks of a trial are one `xarray.Dataset` with the names and dimensions of the package `movement`.

# %%
video = tracks["f1_00_video"]
video

# %%
figure, axes = plt.subplots(figsize=(9, 4), layout="constrained")
for name in video.keypoint.values:
    axes.plot(*video.position.sel(keypoint=name).T, linewidth=1.2, label=name)
axes.set(xlabel="x (px)", ylabel="y (px)", aspect="equal", title=f"{float(video.time[-1]):.1f} s of swimming")
axes.invert_yaxis()
axes.legend(ncols=3, fontsize=8)
plt.show()

# %% [markdown]
# ## 2. Compare with the truth, and with plain CSRT
#
# The renderer stored the true centre of each disc. Plain CSRT, the tracker of OpenCV, starts from the same boxes. It
# reports boxes in whole pixels, so its centres move in steps.

# %%
truth = calib.load_tracks(folder / "truth" / "f1_00_video.csv", session.markers)
plain = calib.track(session, method="csrt")["f1_00_video"]
errors_px = {
    "this tracker": (video.position - truth.position.values).values,
    "plain CSRT": (plain.position - truth.position.values).values,
}

figure, panels = plt.subplots(1, 2, figsize=(9, 3), sharex=True, layout="constrained")
for axes, (name, error_px) in zip(panels, errors_px.items(), strict=True):
    axes.hist(error_px.ravel(), bins=np.arange(-2.025, 2.05, 0.05), weights=np.full(error_px.size, 100 / error_px.size))
    rms = np.sqrt(np.nanmean(error_px**2))
    axes.set(xlabel="error along x or y (px)", ylabel="samples (%)", title=f"{name}: {rms:.2f} px RMS")
plt.show()

# %% [markdown]
# ## 3. Correct a mistake
#
# Suppose that a person sees something wrong with `tail_3` in ten frames: they are dropped, and the gap is filled from
# the other markers, which hold the shape of the tail. A correction is a line in a log next to the video. The tracker's
# own samples are never overwritten, and an edit is undone by one more line.

# %%
first, last = 60, 69
message = calib.correct(session, "f1_00_video", {"op": "drop", "markers": ["tail_3"], "frames": [first, last]})
print(message.rpartition(";")[0].rpartition("/")[2])
filled = calib.track(session, method="hybrid")["f1_00_video"]
states = ["missing", "measured", "predicted", "interpolated", "by hand"]
print("tail_3 in these frames:", states[int(filled.state.sel(keypoint="tail_3")[first])])

# %%
near = slice(first - 25, last + 26)
tail_3 = {"truth": truth, "filled": filled}
tail_3 = {name: data.position.sel(keypoint="tail_3", space="y")[near] for name, data in tail_3.items()}
gap = filled.state.sel(keypoint="tail_3").values[near] == states.index("interpolated")
error_px = float(np.sqrt(np.mean((tail_3["filled"].values - tail_3["truth"].values)[gap] ** 2)))

figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
axes.plot(filled.time[near], tail_3["truth"], color="black", linewidth=1, label="truth")
axes.plot(filled.time[near], tail_3["filled"].where(~gap), "o", markersize=3, label="measured")
axes.plot(filled.time[near], tail_3["filled"].where(gap), "o", markersize=4, label=f"filled, {error_px:.1f} px RMS")
axes.set(xlabel="time (s)", ylabel="y of tail_3 (px)")
axes.invert_yaxis()
axes.legend()
plt.show()

# %% [markdown]
# ## 4. Files for other programs, and a recording to look at
#
# DeepLabCut's CSV and the netCDF of `movement` are written and read. `calib.view` writes a recording for the Rerun
# viewer: video, boxes, tracks, states, confidence and flags over one time axis, and once there is a fit, the twin
# with them. With `inline=True` the notebook shows it (`pip install 'rerun-sdk[notebook]'`).

# %%
own = session.results / "tracking" / "f1_00_video.csv"
for form, name in (("deeplabcut", "f1_00.dlc.csv"), ("movement", "f1_00.nc")):
    back = calib.load_tracks(calib.convert_tracks(own, folder / name, form), session.markers, fps=session.camera.fps)
    print(form, "keeps the positions:", np.allclose(back.position, filled.position, atol=1e-3, equal_nan=True))

recording = calib.view(session).file
print(f"{recording.name}: {recording.stat().st_size / 1e6:.1f} MB")
