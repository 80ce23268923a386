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
# # What changed?
#
# Film a healthy robot, change one thing, film it again. What both sessions share cancels, the error of the twin's water
# first of all, so much smaller effects get a name than in a session alone.
#
# Both sessions in `datasets/pair` are made by a second simulator that shares no code with the twin: the same robot,
# camera, water and commands, new launches. One thing was changed before the second; the last cell tells what.

# %%
import json
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

import calib

# %matplotlib inline

healthy = calib.open_session("../datasets/pair/healthy")
changed = calib.open_session("../datasets/pair/changed")
change = calib.diagnose(changed, reference=healthy, effort="quick")
change

# %% [markdown]
# ## What anyone would look at first
#
# Speeds over frequency, before and after: it is slower at every one. Why is not plain: a shorter crank arm, a softer
# tail, a wrong scale and a current from ahead would all do that.

# %%
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for session, colour in ((healthy, "#777"), (changed, "#d62728")):
    trials = calib.fit(session, effort="quick").to_frame("trials").sort_values("frequency_hz")
    axes.plot(trials.frequency_hz, 1000 * trials.speed_measured, "o-", color=colour, label=session.name)
axes.set(xlabel="frequency of the beat (Hz)", ylabel="forward speed (mm/s)")
axes.legend()
plt.show()

# %% [markdown]
# ## Which
#
# The probability of every effect, and of something else. Each is a change of the second session against the first.

# %%
change.plot.effects()

# %%
change.effects.to_frame().head(5)

# %% [markdown]
# ## How far
#
# The twin of the healthy session forecasts a swim of the changed one that nothing was fitted to: as it is, and with the
# change.

# %%
change.to_frame("trials").T.round(3)

# %%
change.plot.held_out()

# %% [markdown]
# ## What would have shown
#
# The least change of some effects that these swims would show, all else the same. A change below that is no reason to
# look for it in another way.

# %%
visible = pd.DataFrame(
    {name: (each.parameter, each.value, each.unit) for name, each in change.data.reference.visible.items()},
    index=["parameter", "from", "unit"],
).T
visible.loc[["crank_arm_error", "stiffness_error", "scale_error", "background_current", "bend_offset"]]

# %% [markdown]
# ## The truth
#
# It lies apart from the sessions; no diagnosis reads it. The twin has one length for both arms, which were shortened
# by different shares: that is why something else keeps a probability, and why the interval may miss their mean.

# %%
json.loads(Path("../datasets/pair/truth.json").read_text())

# %% [markdown]
# The same on the command line, for sessions of your own; `docs/howto/compare-sessions.md` says how to film them.
#
# ```sh
# calib new changed --videos tuesday/*.mp4 --like healthy
# calib diagnose changed --reference healthy
# calib report changed
# ```
