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
# A camera looked down on a swimming robot fish and a tracker followed nine markers. This notebook turns those tracks
# into a calibrated MuJoCo model, step by step, and then drives the model without any code of this project.
# `calib run datasets/sample` does the same in one command; here every step can be stopped and looked at.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from calib import Options, Pipeline, open_session
from fitting import FORMS
from reports import Gallery, ReportContext, picture_of_tracks

# %matplotlib inline

# %% [markdown]
# ## 1. Open a session
#
# A session is a folder with a `session.toml` and its recordings. Reading it checks everything at once; a fault would
# be told with its file, line and what was expected. Results go to `results/` in the same folder, and what has not
# changed since is not made again.

# %%
session = open_session(Path("../datasets/sample"))
pipeline = Pipeline(session, Options(effort="quick"))

for trial in session.trials:
    commanded = f", {trial.commanded_hz:.2f} crank turns a second commanded" if trial.commanded_hz else ""
    print(f"{trial.name}: {trial.kind}, role {trial.role}{commanded}")

# %% [markdown]
# ## 2. Look at the tracks
#
# Each trial is checked before any fit. Doubtful samples keep their place but get weight 0. The swim frequency comes
# from the tail itself: the motor turns a little slower than it is told.

# %%
for trial in pipeline.trials:
    beat = trial.frequency
    print(
        f"{trial.name}: {beat.hz:.4f} ± {beat.se_hz:.4f} Hz, {1000 * trial.speed:6.1f} mm/s, "
        f"{trial.used_fraction:.1%} of the samples used"
    )
    for flag in trial.flags:
        print(f"    {flag.kind} {', '.join(flag.markers)} {flag.frames or ''}: {flag.message}")

# %%
measured = {trial.name: trial for trial in pipeline.trials}
picture_of_tracks(measured["f1_30"])

# %% [markdown]
# The tracks are plain arrays: in the pool (`position_m`) and in the frame of the head (`head.shape_m`), in metres.
# The tail of the fastest trial, a line a marker:

# %%
fast = measured["f1_30"]
figure, axes = plt.subplots(figsize=(8, 3))
for marker in fast.tail:
    lateral_mm = 1000 * np.where(fast.weight[:, marker] > 0, fast.head.shape_m[:, marker, 1], np.nan)
    axes.plot(fast.time_s, lateral_mm, label=fast.markers[marker])
axes.set(xlabel="time (s)", ylabel="lateral, beside the head's axis (mm)", title=fast.name)
axes.legend(ncols=3, fontsize=8)
plt.show()

# %% [markdown]
# ## 3. What was measured out of the water
#
# A free decay holds the stiffness and damping of the hinges, dry runs the arm of the crank. The fluid fit takes both as
# given; what was not measured stays as in the robot's file, and is said.

# %%
for source in pipeline.structure.sources:
    print(source.sentence)

# %% [markdown]
# ## 4. Fit
#
# Five fluid coefficients, jointly over the fit trials, and a crank phase each. The other trials are held out: of them
# only the first two beats are looked at, to know where the beat stands.

# %%
calibration = pipeline.calibrated()
figures = Gallery(ReportContext(session, calibration, pipeline.job.provenance))

for name, value in calibration.coefficients._asdict().items():
    print(f"{name:13} {value:6.3f}")
for flag in calibration.fit.flags:
    print(f"! {flag.message}")

# %% [markdown]
# The figures of the report have the names under which its page saves them (`list(figures)` tells all). Blue is the
# twin, black was measured; the dotted outline is the measured envelope in both panels.

# %%
figures["f1_30-envelope"]

# %%
figures["f1_00-path"]

# %%
figures["residual-markers"]

# %% [markdown]
# `coefficient-values` shows where every restart ended. Marks that lie apart although they fit about as well are a
# coefficient that these data do not hold. `coefficient-profiles` says the same without a search: where a curve stays
# flat, the markers hardly care.

# %%
figures["coefficient-values"]

# %%
evidence = pipeline.evidence(calibration)
figures = Gallery(ReportContext(session, calibration, pipeline.job.provenance, evidence=evidence))
figures["coefficient-profiles"]

# %% [markdown]
# The head frame hangs on two boxes that a hand has placed. `mean-shapes` shows how much of the distance is a matter of
# where these, and the markers on the body, sit: on the real robot it is more than the coefficients can mend. This
# session was made with boxes some 2 px off.

# %%
for trial in evidence.placed.trials:
    turned, larger = np.degrees(trial.boxes.turn_rad), trial.boxes.scale
    print(f"{trial.name}: the head frame is turned by {turned:+.1f} degrees, all seems {larger:.3f} times as large")
figures["mean-shapes"]

# %% [markdown]
# ## 5. Compare with elongated body theory
#
# Lighthill's theory predicts the speed from the motion of the tail tip. It is used in three forms, each fitted to the
# same fit trials; only its ratio `c_D / beta` can be known from speeds.

# %%
for form in FORMS:
    ebt = calibration.ebts[form.name]
    print(f"{form.label:45} c_D / beta = {ebt.drag_coefficient / ebt.beta:.3f}")

# %%
models = list(calibration.trials[0].speeds)
print(f"{'mean absolute speed error, mm/s':40} {'fit':>6} {'held out':>9}")
for model in models:
    errors = [1000 * calibration.summary(role).speed_mae[model] for role in ("fit", "holdout")]
    print(f"{model:40} {errors[0]:6.1f} {errors[1]:9.1f}")

# %% [markdown]
# The theory sees the measured tail of each trial. The twin sees the trial's first two beats, which give it frequency,
# phase and start, and runs on alone. Where a row says "twin's tail" the theory, too, does without the measured one.
# (`fitting.forecast_from_command` looks at nothing of the trial but its command; the report has its errors.)

# %%
figures["sweep"]

# %%
figures["speed-errors"]

# %% [markdown]
# ## 6. Write the model
#
# `results/calibrated.xml` is a plain MJCF. It holds the coefficients, stiffness and tendons, and one keyframe a fit
# trial that starts the twin as that trial started.

# %%
pipeline.fit()
mjcf = session.results / "calibrated.xml"
text = mjcf.read_text()
print(f"{len(text) / 1000:.0f} kB")
print(text[text.index("<keyframe>") : text.index("</keyframe>")][:400], "…")

# %% [markdown]
# ## 7. Drive it in plain MuJoCo
#
# From here on there is no code of ours. The only control is the speed of the crank, in rad/s. The first five seconds
# go on as `f1_30` started; then the crank slows down to 0.6 turns a second.

# %%
model = mujoco.MjModel.from_xml_path(str(mjcf))
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
# A beat is a turn of the crank, so the speed is best read as the distance between two places one turn apart.

# %%
whole = crank_rad >= crank_rad[0] + 2 * np.pi
turn_ago = crank_rad[whole] - 2 * np.pi
turned_s, *turned_m = [now[whole] - np.interp(turn_ago, crank_rad, now) for now in (time_s, *place_m)]
speed = np.hypot(*turned_m) / turned_s

figure, (above, below) = plt.subplots(2, 1, figsize=(8, 4.6), height_ratios=(1, 2), layout="constrained")
above.plot(*place_m)
above.set(xlabel="x (m)", ylabel="y (m)", title="path of the head, swum from right to left", aspect="equal")
below.plot(time_s[whole], 1000 * speed, label="twin, over the turn before")
below.axhline(1000 * fast.speed, color="black", linestyle=":", label="f1_30 as measured")
below.axhline(1000 * measured["f0_60"].speed, color="black", linestyle="--", label="f0_60 as measured")
below.set(xlabel="time (s)", ylabel="speed (mm/s)", ylim=(0, None), title="the crank slows down after 5 s")
below.legend(loc="lower left", ncols=3, fontsize=8)
plt.show()

# %% [markdown]
# What this twin cannot do stands in the report: `pipeline.report()` writes `results/report.html`, and every number
# there has its doubts beside it.
