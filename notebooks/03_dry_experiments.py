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
# # The dry experiments: stiffness, crank and motor
#
# A twin needs the stiffness and damping of its hinges and the arm of its crank. A drawing gives these numbers badly:
# printed hinges are softer or stiffer than planned, and an arm measured with a ruler is a millimetre off. Three kinds
# of data measure them in air: a free decay, a dry run and the motor's log. This notebook starts from wrong numbers
# and shows what the recordings make of them.
#
# The recordings are those of `datasets/sample`. They are synthetic, so the truth is known: its tail is 2 % heavier than
# described, and a decay tells stiffness and damping over mass, so the truth below is that of a tail as described.

# %%
import shutil
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import calib

# %matplotlib inline

truth = np.array([0.635, 0.0209, 0.0395])  # hinge stiffness (N m/rad) and damping (N m s/rad), crank arm (m)
assumed = np.array([0.50, 0.030, 0.0375])

# %% [markdown]
# ## 1. A session without water
#
# A session may consist of dry experiments alone. This one has three free decays (tail bent and released, tendons off)
# and two dry runs (head clamped, motor on). Its robot file holds the assumed numbers. Lines with an exclamation mark
# are caveats.

# %%
folder = Path(tempfile.mkdtemp()) / "bench"
shutil.copytree("../datasets/sample", folder, ignore=shutil.ignore_patterns("results"))


def robot_file(name, stiffness, damping, arm):
    """The published robot with other numbers."""
    text = Path("../swimcal/robots/fish_057.toml").read_text()
    text = text.replace("hinge_stiffness_n_m = 0.65", f"hinge_stiffness_n_m = {stiffness}")
    text = text.replace("hinge_damping_n_m_s = 0.02", f"hinge_damping_n_m_s = {damping}")
    (folder / name).write_text(text.replace("arm_m = 0.0395", f"arm_m = {arm}"))
    return folder / name


robot_file("robot.toml", *assumed)
settings, *trials = (folder / "session.toml").read_text().split("[[trial]]")
dry = [trial for trial in trials if 'kind = "swim"' not in trial]
(folder / "session.toml").write_text("[[trial]]".join([settings + '[robot]\nfile = "robot.toml"\n\n', *dry]))

session = calib.open_session(folder)
bench = calib.fit(session, effort="quick")
print(*bench.details(), sep="\n")

# %% [markdown]
# ## 2. Free decay
#
# The released tail swings for little more than one period. The peak of the spectrum is a first estimate of its
# frequency. The fit of the whole curve gives stiffness and damping, with the bent shape and the places of the markers
# free.

# %%
decay = bench.data.decays[0]
spectrum = decay.spectrum

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
left.plot(spectrum.bins_hz, 1000 * spectrum.rms_m, color="black")
left.axvline(spectrum.peak_hz, linestyle="--", label=f"peak at {spectrum.peak_hz:.2f} Hz")
left.set(xlabel="frequency (Hz)", ylabel="amplitude (mm)", xlim=(0, 12), ylim=(0, None), title="spectrum")
for marker in ("tail_3", "tail_5", "caudal_fin"):
    place = decay.markers.index(marker)
    right.plot(decay.time_s, 1000 * decay.simulated_m[:, place], label=marker)
    right.plot(decay.time_s, 1000 * decay.measured_m[:, place], ".", color="black", markersize=4)
right.set(xlabel="time (s)", ylabel="lateral position (mm)", xlim=(0, 0.8), title="measured (dots) and fitted")
for axes in (left, right):
    axes.legend()
plt.show()

# %% [markdown]
# ## 3. Dry run and motor
#
# The motor writes a log. Short reversals at both ends are a code, by which the clock of the log is matched to that of
# the video. Between them the motor turns as fast as commanded on the mean, unevenly under its load.

# %%
log, sent = (pd.read_csv(folder / "trials" / f"dry_0_60.{kind}.csv") for kind in ("motor", "commands"))
crank = bench.data.crank

figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
for table, style in ((sent, {"label": "commanded", "drawstyle": "steps-post"}), (log, {"label": "measured"})):
    axes.plot(table.time_s - log.time_s[0], table.velocity_rad_s / (2 * np.pi), **style)
axes.set(xlabel="time (s)", ylabel="crank (turns/s)")
axes.set(title=f"{crank.trials[0].measured.name}: {crank.trials[0].speed_hz:.3f} turns/s of 0.600 commanded")
axes.legend()
plt.show()

# %% [markdown]
# ## 4. Measured against assumed
#
# How far the tail swings gives the crank arm. The published estimate takes each run alone and trusts the start boxes
# of nose and neck, which are a few pixels off. The joint fit of both runs leaves these offsets free.

# %%
frame, scale = bench.to_frame(), (1, 1, 1000)
figure, panels = plt.subplots(1, 3, figsize=(9, 2.6), layout="constrained")
for axes, (name, row), true, guess, factor in zip(panels, frame.iterrows(), truth, assumed, scale, strict=True):
    axes.axhline(factor * true, color="black", linestyle=":", label="truth")
    axes.plot(0, factor * guess, "x", color="tab:red", markersize=9, label="assumed")
    axes.errorbar(1, factor * row.value, 1.645 * factor * row.se, fmt="o", capsize=5, label="measured, 90 %")
    axes.set(title=name.replace("_", " "), xticks=[], xlim=(-1, 3), ylabel="mm" if factor > 1 else row.unit)
axes.plot([2, 2], 1000 * np.array(crank.arm_per_trial_m), "D", color="tab:orange", label="each run alone")
figure.legend(*axes.get_legend_handles_labels(), ncols=4, loc="outside lower center")
plt.show()
frame[["value", "se", "unit"]].assign(guess=assumed, truth=truth)

# %% [markdown]
# What this means for a swim: the twin with assumed numbers is up to 6 % too fast or too slow, by another share at
# each frequency. Fluid coefficients fitted with it would have to make up for that, and would be wrong.

# %%
hz, robots = np.arange(0.4, 1.45, 0.2), {"truth": truth, "assumed": assumed, "measured": frame.value}
speed = {name: calib.load_twin(robot_file(f"{name}.toml", *robots[name])).swim(hz, 6.0).speed for name in robots}

figure, axes = plt.subplots(figsize=(9, 2.8), layout="constrained")
axes.axhline(0, color="black", linestyle=":")
for name, style in (("assumed", "x--r"), ("measured", "o-")):
    axes.plot(hz, 100 * (speed[name] / speed["truth"] - 1), style, label=f"twin with {name} numbers")
axes.set(xlabel="frequency (Hz)", ylabel="speed, off the truth (%)")
axes.legend()
plt.show()

# %% [markdown]
# The same on the command line; the first line drives and logs the motor:
#
# ```sh
# calib capture run --port /dev/ttyUSB0 --hz 0.6,0.9 --kind dry --out bench
# calib fit bench --effort quick
# ```
#
# `docs/bench.md` says how to record, and how accurate this is. In a session with swim trials `calib.fit` uses the
# measured numbers for the swims, and `fit.plot` has these figures too: `decay`, `decay_spectrum`, `crank`,
# `motor_speed`.
