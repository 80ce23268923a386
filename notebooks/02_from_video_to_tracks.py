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
# A camera looked down on a swimming robot fish with nine round markers. This notebook finds the markers, follows them,
# and shows what the tracker says of its own samples: how each came about, how sure it is, and what is doubtful. Then
# it makes two mistakes and mends them. `calib track datasets/sample` does the same in one command.
#
# The videos here are rendered, so that the truth is known. They are kinder than a pool: see `docs/tracking.md`.

# %%
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Image
from rerun.chunk import RrdReader

from benchmarks.video import ClipPlan, Occlusion, Swim, render_clip
from reports.recording import RecordedTrial, make_proxy, write_recording
from session import InputError, load_session, load_tracks
from swimmer import load_robot
from tracking import check_tracks
from tracking.boxes import ClickBoxes, StartBoxes, find_boxes, write_preview
from tracking.boxes.preview import marker_colour
from tracking.records import (
    Drop,
    EditLog,
    SampleState,
    Swap,
    TrackedTrial,
    apply_edits,
    export_tracks,
    fill_gaps,
    load_deeplabcut,
    load_movement,
)
from tracking.tracker import PlainCsrt, follow_video, judge
from tracking.video import Video

# %matplotlib inline

scratch = TemporaryDirectory()
folder = Path(scratch.name)

# %% [markdown]
# ## 1. Open the video
#
# Every frame has a number and the time stamp that the file gives it; both are the same however a frame is reached. A
# damaged or cut file is read as far as it goes, and `info.caveats` and `damage` say what is missing.

# %%
session = load_session(Path("../datasets/sample"))
trial = session.trial("f1_00_video")
markers = session.markers
video = Video(trial.video)

info = video.info
print(f"{info.frames} frames, {info.width_px} x {info.height_px} px, {info.codec}, {info.fps:.2f} frames a second")
print(f"frame 100 is at {video.frame(100).time_s:.6f} s; caveats: {info.caveats or 'none'}")

# %% [markdown]
# ## 2. Find the start boxes
#
# Round spots of one brightness are sought all over the frame, and the robot's marker layout is laid over them at any
# place, heading, scale and bend. What is found is either certain or refused.

# %%
robot = load_robot()
layout_m = robot.marker_positions_m(markers)[:, :2]
first = video.frame(0)
found = find_boxes(first.luma, layout_m, markers)

print(f"{found.polarity} markers of {found.diameter_px.min():.0f} to {found.diameter_px.max():.0f} px")
print(f"probability {found.confidence:.4f}, next best body {found.runner_up:.4f}")

# %% [markdown]
# The preview is what to look at before hours of video are tracked on it. `calib track` always writes it.

# %%
write_preview(folder / "boxes.png", first.rgb(), found.boxes)
Image(folder / "boxes.png", width=900)

# %% [markdown]
# ## 3. When they are not found
#
# Let something lie on the neck marker. Eight markers are no robot of nine, and nothing is guessed:

# %%
column, row = (round(value) for value in found.boxes.boxes["neck"].centre_px)
covered = first.luma.copy()
covered[row - 20 : row + 20, column - 20 : column + 20] = first.luma[20:60, 20:60]

try:
    find_boxes(covered, layout_m, markers, file="a frame with a covered neck")
except InputError as refusal:
    print(refusal)

# %% [markdown]
# Then a person clicks. In a notebook a `ClickBoxes` in the last line of a cell shows its page; without one,
# `calib track SESSION --click` writes the same page as a file for the browser. A click snaps to the nearest spot, the
# markers are asked for one after another, and the page saves `f1_00_video.boxes.json`, to be put beside the video.

# %%
ClickBoxes(first.rgb(), markers, trial.name, blobs=found.blobs, layout_m=layout_m)

# %% [markdown]
# ## 4. Track
#
# One pass over the frames. In each the motion so far says where the markers should be; spots near there are assigned
# to the markers jointly, so that no two share one; then each centre is measured to a fraction of a pixel.

# %%
tracked = follow_video(video, found.boxes, markers)
flags = (*tracked.flags, *judge(tracked, robot))

print(f"{tracked.seen.mean():.1%} of {tracked.seen.size} samples are measured, {len(flags)} flags")

# %%
figure, axes = plt.subplots(figsize=(9, 5.1), layout="constrained")
axes.imshow(video.frame(info.frames - 1).rgb())
for number, name in enumerate(markers):
    path_px = tracked.tracks.position_px[:, number]
    axes.plot(*path_px.T, color=marker_colour(number), linewidth=1.3, label=name)
    axes.plot(*path_px[-1], "o", color=marker_colour(number), markeredgecolor="black", markersize=5)
axes.set(xticks=[], yticks=[], title=f"{info.time_s[-1]:.1f} s of swimming, a line a marker")
axes.legend(loc="lower right", ncols=3, fontsize=8)
plt.show()

# %% [markdown]
# ## 5. Compare with the truth
#
# The renderer kept where the middle of each disc appeared. Plain CSRT, the tracker that OpenCV brings along, gets the
# same boxes, for 30 frames only because it is slow. Its boxes hold whole pixels, so its centres step.

# %%
true_px = load_tracks(session.folder / "truth" / "f1_00_video.csv", markers, info.fps).position_px
corners_px = np.array([found.boxes.boxes[name] for name in markers])
csrt = PlainCsrt(first.luma, corners_px[:, :2], corners_px[:, 2:])
csrt_px = np.array([csrt.step(frame.luma).position_px for frame in video.frames(1, 31)])

errors_px = {"this tracker": tracked.tracks.position_px - true_px, "plain CSRT": csrt_px - true_px[1:31]}
for name, error_px in errors_px.items():
    rms, bias = np.sqrt(np.mean(error_px**2)), np.abs(error_px.mean(axis=(0, 1))).max()
    print(f"{name:13} {rms:.3f} px RMS an axis, bias {bias:.3f} px")

# %%
figure, panels = plt.subplots(1, 2, figsize=(9, 3.2), sharex=True, layout="constrained")
for axes, (name, error_px), colour in zip(panels, errors_px.items(), ("#1769aa", "#777777"), strict=True):
    axes.hist(
        error_px.ravel(),
        bins=np.arange(-1.625, 1.65, 0.05),
        weights=np.full(error_px.size, 100 / error_px.size),
        color=colour,
    )
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set(
        xlabel="error along x or y (px)",
        ylabel="samples (%)",
        title=f"{name}: {np.sqrt(np.mean(error_px**2)):.2f} px RMS",
    )
plt.show()

# %% [markdown]
# ## 6. A person's mistake, found and corrected
#
# Suppose that `tail_2` and `tail_3` were clicked in the wrong order. The tracker follows faithfully what it was told;
# but the markers of a tail stand in one order along it, and `judge` sees that they do not.

# %%
boxes = found.boxes.boxes
wrong = StartBoxes(0, boxes | {"tail_2": boxes["tail_3"], "tail_3": boxes["tail_2"]})
mistaken = follow_video(video, wrong, markers)
for flag in judge(mistaken, robot):
    print(f"{flag.kind:12} frames {flag.frames}: {flag.message}")

# %% [markdown]
# Corrections go into a log beside the video, one a line. Nothing is overwritten: the tracker's own samples stay, the
# log is replayed on a copy, and an edit is undone by one more line. On the command line this is `calib edit`.

# %%
log = EditLog.load(folder / "f1_00_video.edits.jsonl", markers, info.frames)
log = log.append(Swap(markers=("tail_2", "tail_3"), note="clicked in the wrong order"))
print(log.path.read_text())

corrected = apply_edits(mistaken, log)
for flag in (*corrected.flags, *judge(corrected, robot)):
    print(f"{flag.kind:12} {flag.message}")
same = np.allclose(corrected.tracks.position_px, tracked.tracks.position_px, atol=0.01)
print(f"same tracks as from the right boxes, to 0.01 px: {same}")

# %% [markdown]
# ## 7. Markers that are hidden
#
# A faster swim, in which a pole is held over `tail_2` for 10 frames and over `caudal_fin` for 26. What the tracker does
# not see it carries on for 12 frames as `predicted`; then the sample is `missing`. Neither counts in a fit. `judge`
# looks at what the tracker says of its samples, `check_tracks` at any tracks, wherever they come from.

# %%
poles = (
    Occlusion(marker="tail_2", first=60, frames=10),
    Occlusion(marker="caudal_fin", first=120, frames=26),
)
swim = Swim(frequency_hz=1.5, drift_m_s=(0.03, 0.0), heading_deg=172.0)
plan = ClipPlan(frames=200, seed=3, swim=swim, occlusions=poles)
truth = render_clip(plan, folder / "poles.mp4")

with Video(folder / "poles.mp4") as hidden:
    start = find_boxes(hidden.frame(0).luma, layout_m, markers).boxes
    covered_rgb = hidden.frame(65).rgb()
    raw = follow_video(hidden, start, markers)

for flag in (*judge(raw, robot), *check_tracks(raw.tracks, robot).flags):
    print(f"{flag.kind:12} frames {flag.frames}: {flag.message}")

# %% [markdown]
# The first pole slides over `tail_3` as well. Half a marker has its centre of light elsewhere, and the confidence falls
# before the marker is given up. Without the truth one sees the flagged jump. Those frames are dropped by hand, and the
# gaps filled.

# %%
log = EditLog.load(folder / "poles.edits.jsonl", markers, len(raw.state))
log = log.append(Drop(markers=("tail_3",), frames=(64, 69), note="half under the pole"))
filled = fill_gaps(apply_edits(raw, log))
for flag in filled.flags:
    print(f"{flag.kind:12} {flag.message}")

third = markers.index("tail_3")
for name, after in (("before", raw), ("after", filled)):
    off_px = np.linalg.norm(after.tracks.position_px - truth.shown_px, axis=2)[64:67, third]
    print(f"tail_3 in frames 64 to 66, {name}: off by", ", ".join(f"{px:.1f} px" for px in off_px))

# %%
COLOURS = {
    SampleState.MEASURED: "#b9d4e8",
    SampleState.PREDICTED: "#e08a00",
    SampleState.INTERPOLATED: "#8e44ad",
    SampleState.MISSING: "#222222",
}


def show_states(axes: plt.Axes, trial: TrackedTrial, title: str) -> None:
    """A row a marker: how each sample came about."""
    for number in range(len(markers)):
        for state, colour in COLOURS.items():
            frames = np.flatnonzero(trial.state[:, number] == state)
            axes.broken_barh([(frame - 0.5, 1) for frame in frames], (number - 0.4, 0.8), facecolors=colour)
    axes.set(yticks=range(len(markers)), yticklabels=markers, title=title, xlim=(-0.5, len(trial.state) - 0.5))
    axes.invert_yaxis()


figure, (above, middle, below) = plt.subplots(3, 1, figsize=(9, 7.6), sharex=True, layout="constrained")
show_states(above, raw, "as the tracker left it")
for number, name in enumerate(markers):
    middle.plot(raw.tracks.confidence[:, number], color=marker_colour(number), label=name)
middle.set(ylabel="confidence", ylim=(-0.02, 1.02), facecolor="#10151a")
middle.legend(loc="lower left", ncols=2, fontsize=7, facecolor="#10151a", labelcolor="white", framealpha=0.9)
show_states(below, filled, "after the edit, gaps filled")
below.set(xlabel="frame")
keys = [plt.Rectangle((0, 0), 1, 1, color=colour) for colour in COLOURS.values()]
figure.legend(keys, [state.word for state in COLOURS], loc="outside upper center", ncols=4, frameon=False)
plt.show()

# %% [markdown]
# A short gap is filled from the other markers, which hold the tail's shape, not by a line in time. How well that works
# was rehearsed on the same video before it was done. The long gap is left open, and its flag says why: 0.25 s is the
# limit.

# %%
second, near = markers.index("tail_2"), slice(40, 85)
frames = np.arange(len(raw.state))[near]
states, y_px = filled.state[near, second], filled.tracks.position_px[near, second, 1]
gap = filled.state[:, second] == SampleState.INTERPOLATED
error_px = (filled.tracks.position_px - truth.shown_px)[gap, second]

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), width_ratios=(1, 1.7), layout="constrained")
x, y = truth.shown_px[65, second]
left.imshow(covered_rgb)
left.set(xlim=(x - 90, x + 90), ylim=(y + 90, y - 90), xticks=[], yticks=[], title="frame 65")
right.plot(frames, truth.shown_px[near, second, 1], color="black", linewidth=1, label="truth")
for state in (SampleState.MEASURED, SampleState.INTERPOLATED):
    which = states == state
    style = {"markersize": 4, "color": COLOURS[state], "markeredgecolor": "#555555"}
    right.plot(frames[which], y_px[which], "o", label=state.word, **style)
right.set(xlabel="frame", ylabel="y of tail_2 (px)", title=f"filled to {np.sqrt(np.mean(error_px**2)):.1f} px RMS")
right.invert_yaxis()
right.legend(fontsize=8, loc="upper right")
plt.show()

# %% [markdown]
# ## 8. Files for other programs
#
# DeepLabCut's CSV and the netCDF of the `movement` package are written and read. The netCDF keeps times, states and
# sizes; the CSV keeps positions and likelihoods.

# %%
export_tracks(tracked, folder / "f1_00_video.dlc.csv", "deeplabcut")
export_tracks(filled, folder / "poles.nc", "movement")

print("\n".join(line[:86] for line in (folder / "f1_00_video.dlc.csv").read_text().splitlines()[:5]))
back = load_deeplabcut(folder / "f1_00_video.dlc.csv", markers, info.fps)
print(f"positions as written: {np.array_equal(back.position_px, tracked.tracks.position_px)}")
print(f"states as written: {np.array_equal(load_movement(folder / 'poles.nc', markers, 60.0).state, filled.state)}")

# %% [markdown]
# ## 9. A recording to look at
#
# The Rerun viewer shows video, boxes, tracks, states, confidence and flags over one time axis. Here it is written and
# read back; `calib view datasets/sample --open` also opens it, and shows the twin beside the tracks once there is a
# fit.

# %%
make_proxy(folder / "poles.mp4", folder / "poles.small.mp4")
picture_px = (plan.optics.width_px, plan.optics.height_px)
shown = TrackedTrial(filled.tracks, filled.state, filled.size_px, (*filled.flags, *judge(filled, robot)))
write_recording(
    folder / "poles.rrd", [RecordedTrial("poles", shown, folder / "poles.small.mp4", picture_px)], "hidden markers"
)

print(f"{(folder / 'poles.rrd').stat().st_size / 1e6:.1f} MB")
entities = {chunk.entity_path for chunk in RrdReader(folder / "poles.rrd").stream()}
for entity in sorted(name for name in entities if name.startswith("/poles/") and "/states/" not in name):
    print(entity)

# %%
video.close()
scratch.cleanup()
