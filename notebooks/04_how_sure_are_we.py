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
# # How sure are we?
#
# A fit gives five numbers. This notebook asks how far each could be off: it draws from the posterior of the five fluid
# coefficients, checks the draws, looks at what the trials determine and what they predict, and ends with the trial to
# film next.
#
# The session is synthetic: its tracks are made with the twin, so the true coefficients are known and nothing is left
# out of the model. On a real robot intervals can be too narrow, see `docs/posterior.md`. For a session of your own
# change the line that begins with `session =`, and leave out the columns with the truth.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import calib

# %matplotlib inline

session = calib.open_session(calib.new_session(Path(tempfile.mkdtemp()) / "known", synthetic=True))
fit = calib.fit(session, effort="quick")

# %% [markdown]
# ## 1. Draw from the posterior
#
# The search for the best coefficients needs a minute; the draws need a few more.

# %%
posterior = calib.posterior(session, effort="quick")
posterior

# %% [markdown]
# Each pair of coefficients: shaded are the regions that hold 50 % and 90 % of the draws. A long, tilted region means
# that the trials fix a combination of two coefficients better than each one.

# %%
posterior.plot.corner()

# %% [markdown]
# The five 90 % intervals and the truth. An interval may miss in one of ten cases, so with five of them at least one
# misses in about four of ten sessions.

# %%
truth = np.array([0.4, 2.0, 6.0, 4.0, 1.0])  # blunt, slender and angular drag, Kutta and Magnus lift
table = posterior.to_frame()[["q05", "mean", "q95"]].assign(truth=truth)
table.assign(inside=(table.q05 <= truth) & (truth <= table.q95)).round(3)

# %% [markdown]
# ## 2. Are the draws good?
#
# Four groups of walkers should visit all ranks about equally often (grey: 95 % band). Draws for which this fails by
# R-hat or effective number are never reported: `calib.posterior` raises `NotConverged`.

# %%
posterior.plot.ranks()

# %% [markdown]
# `posterior.idata` is what ArviZ reads, so any question to the draws is a line: how probable is it that the Magnus lift
# is larger than 1.2, and how strongly do the two lifts go together?

# %%
draws = posterior.idata.posterior
print(f"P(Magnus lift > 1.2) = {float((draws.magnus_lift > 1.2).mean()):.2f}")
lifts = np.stack([draws.kutta_lift.values.ravel(), draws.magnus_lift.values.ravel()])
print(f"correlation of Kutta and Magnus lift: {np.corrcoef(lifts)[0, 1]:+.2f}")

# %% [markdown]
# ## 3. What do the trials determine?
#
# A coefficient counts as determined if its 90 % interval spans at most a factor of 2.5, or at most 0.5. The prior is
# uniform from 0 to 10.

# %%
posterior.to_frame()[["q05", "q95", "determined"]].round(3)

# %% [markdown]
# ## 4. What does it predict?
#
# Only two trials were fitted; the others are held out. The bands hold all that stands between twin and trial:
# coefficients, noise, and the variation from trial to trial.

# %%
posterior.plot.speeds()

# %%
trials = posterior.to_frame("trials")
speed = 1000 * trials[["speed_measured", "speed_q05", "speed_q50", "speed_q95"]]
off = speed[["speed_q05", "speed_q50", "speed_q95"]].sub(speed.speed_measured, axis=0)

figure, axes = plt.subplots(figsize=(8, 2.8), layout="constrained")
for role, colour in (("fit", "black"), ("holdout", "tab:blue")):
    one = off[trials.role == role]
    bars = np.abs([one.speed_q05 - one.speed_q50, one.speed_q95 - one.speed_q50])
    axes.errorbar(one.speed_q50, one.index, xerr=bars, fmt="o", color=colour, capsize=4, label=role)
axes.axvline(0, color="black", linestyle=":", label="measured")
axes.set(xlabel="predicted speed with 90 % band, off the measured one (mm/s)")
axes.legend()
plt.show()

# %% [markdown]
# ## 5. Which trial next?
#
# The expected standard deviation of every coefficient after one more trial, over its frequency. Where no frequency
# gains much, as here, another trial is not urgent.

# %%
posterior.plot.further_trial()

# %%
sweep = posterior.data.sweep
gain = sweep.shrinkage(posterior.data.wanted)
best = gain.argmin()
print(f"Film {sweep.frequency_hz[best]:.2f} Hz next: standard deviations fall to {100 * gain[best]:.0f} % of now.")

# %% [markdown]
# The same on the command line; the report has these figures:
#
# ```sh
# calib posterior pool --effort quick
# calib report pool
# ```
