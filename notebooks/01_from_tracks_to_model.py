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
# # From tracks to a model
#
# A camera looked down on a swimming robot fish, and a tracker followed nine markers. This notebook turns those tracks
# into a calibrated MuJoCo model, and then drives the model without any code of this project. `calib run
# datasets/sample` does the same in one command; here every step can be looked at.

# %%
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import calib

# %matplotlib inline

# %% [markdown]
# ## 1. Open a session
#
# A session is a folder with a `session.toml` and its recordings. Opening it checks everything at once; a fault is
# reported with its file, its line and what was expected. Results go to `results/` in the same folder. What has not
# changed is not made again.

# %%
session = calib.open_session("../datasets/sample")
for trial in session.trials:
    print(f"{trial.name:12} {trial.kind:10} {trial.role:8} commanded: {trial.commanded_hz or '-'} Hz")

# %% [markdown]
# ## 2. Look at the tracks
#
# Each trial is checked before any fit. Doubtful samples keep their place but get weight 0. The beat frequency comes
# from the tail itself, not from the command.

# %%
tracks = calib.track(session)
tracks.to_frame().round(4)

# %% [markdown]
# The tracks of a trial are one labelled `xarray.Dataset`: pixels as filmed, metres in the pool, metres in the frame
# of the head. The tail of the fastest trial, a line a marker:

# %%
tail = [f"tail_{number}" for number in range(1, 6)] + ["caudal_fin"]
fast = tracks["f1_30"]
lateral_mm = 1000 * fast.position_head.where(fast.weight > 0).sel(space="y", keypoint=tail)

figure, axes = plt.subplots(figsize=(8, 3))
axes.plot(fast.time, lateral_mm, label=tail)
axes.set(xlabel="time (s)", ylabel="lateral position (mm)", title="f1_30, in the frame of the head")
axes.legend(ncols=3, fontsize=8)
plt.show()

# %% [markdown]
# ## 3. Fit
#
# Free decays give the stiffness and damping of the hinges, dry runs the arm of the crank. The five fluid coefficients
# are then the most probable ones in a hierarchical model of the fit trials. Measurement noise, misplaced boxes, trim
# and a model discrepancy are part of this model. The other trials are held out and forecast.

# %%
fit = calib.fit(session, effort="quick")
fit

# %% [markdown]
# Every figure of the report is a method of `fit.plot`. Blue is the twin, black was measured; the dotted outline is
# the measured envelope in both panels.

# %%
fit.plot.envelope("f1_30")

# %%
fit.plot.path("f1_00")

# %%
fit.plot.residual_markers()

# %% [markdown]
# The coefficients with 90 % intervals, and where the other start of the search ended. Where two marks of a
# coefficient lie apart but are about equally likely, these trials do not identify it.

# %%
fit.plot.coefficients()

# %% [markdown]
# ## 4. Compare with baselines
#
# The simplest baseline is a straight line in frequency through the fitted speeds: a twin must beat it.
# `given_frequency` is the twin, given the frequency, with its model discrepancy from the fit trials. `after_two_beats`
# knows the first two beats of the trial as well; `continued` is the continuation of these beats. Elongated body theory
# (Lighthill) sees the measured tail of the whole trial.

# %%
(1000 * fit.to_frame("speed_errors")).round(1).rename_axis("mean absolute speed error, mm/s")

# %%
fit.plot.forecasts()

# %%
fit.plot.speeds()

# %% [markdown]
# ## 5. The model
#
# `results/calibrated.xml` is a plain MJCF with the coefficients, stiffness and tendons, and one keyframe a fit trial
# that starts the twin as that trial started. From here on there is no code of ours. The only control is the speed of
# the crank, in rad/s: five seconds go on as `f1_30` started, then the crank slows down to 0.6 turns a second.

# %%
model = mujoco.MjModel.from_xml_path(str(fit.mjcf_file))
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("f1_30").id)

states = []
while data.time < 12.0:
    if data.time >= 5.0:
        data.ctrl[0] = 2 * np.pi * 0.6
    mujoco.mj_step(model, data)
    states.append([data.time, data.joint("crank").qpos[0], *data.body("head").xpos[:2]])
time_s, crank_rad, *place_m = np.array(states).T

# %% [markdown]
# A beat is one turn of the crank. The speed is the distance swum during the last turn, divided by its duration.

# %%
whole = crank_rad >= crank_rad[0] + 2 * np.pi
turn_ago = crank_rad[whole] - 2 * np.pi
turned_s, *turned_m = [now[whole] - np.interp(turn_ago, crank_rad, now) for now in (time_s, *place_m)]

figure, (above, below) = plt.subplots(2, 1, figsize=(8, 4.6), height_ratios=(1, 2), layout="constrained")
above.plot(*place_m)
above.set(xlabel="x (m)", ylabel="y (m)", title="path of the head, swum from right to left", aspect="equal")
below.plot(time_s[whole], 1000 * np.hypot(*turned_m) / turned_s, label="twin, over the turn before")
for name, style in (("f1_30", ":"), ("f0_60", "--")):
    below.axhline(1000 * fit.trials[name].speed_measured, color="black", linestyle=style, label=f"{name} as measured")
below.set(xlabel="time (s)", ylabel="speed (mm/s)", ylim=(0, None), title="the crank slows down after 5 s")
below.legend(loc="lower left", ncols=3, fontsize=8)
plt.show()

# %% [markdown]
# `calib.report(session)` writes the page with all of this; `calib.posterior(session)` says how sure the coefficients
# are, and `calib.diagnose(session)` what the twin still gets wrong.
