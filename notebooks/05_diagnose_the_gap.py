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
# # Diagnose the gap
#
# A calibrated twin still differs from the robot. Where does the gap arise, which effect causes it, and how much of
# the gap closes with that effect in the model?
#
# The session is one of `datasets/withheld/small`. It was made by a second simulator that shares no code with the
# twin, with an effect that the twin leaves out. The last cell opens the answer, which no diagnosis reads.

# %%
import json
from pathlib import Path

import matplotlib.pyplot as plt

import calib

# %matplotlib inline

session = calib.open_session("../datasets/withheld/small/sessions/wc4264fc2")
gap = calib.diagnose(session, effort="quick")
gap

# %% [markdown]
# ## Where
#
# Shares of the squared residual of the plain twin, whitened by measurement noise and nuisance parameters. Red is
# where the gap comes from, blue where it shows.

# %%
gap.plot.fish()

# %%
gap.plot.where()

# %% [markdown]
# The same as physics: the forces and torques that the plain twin lacks, over a turn of the crank, with two standard
# deviations.

# %%
gap.plot.forces() if "gap-forces" in gap.plot.names else "No force stands out of its uncertainty."

# %% [markdown]
# ## Which
#
# The probability of every effect of the catalogue, and of an effect outside it. Effects that are named are added to
# the twin; their parameters have 95 % intervals.

# %%
gap.effects.to_frame().head(8)

# %%
gap.plot.effects()

# %% [markdown]
# ## How far
#
# Both twins, fitted to the same trials, forecast trials that neither has seen.

# %%
gap.to_frame("trials").T.round(3)

# %%
gap.plot.held_out()

# %% [markdown]
# Does it help the speed more than a straight line in frequency through the fitted speeds would? That is the baseline
# which every forecast has to beat.

# %%
fit = calib.fit(session, effort="quick")
errors = (1000 * fit.to_frame("speed_errors").holdout[["line", "twin"]]).to_dict()
errors["twin with effects"] = 1000 * gap.size.speed_mae_after

figure, axes = plt.subplots(figsize=(6, 2.2))
axes.barh([name.replace("_", " ") for name in errors], list(errors.values()), color=["#999", *["#4c78a8"] * 2])
axes.invert_yaxis()
axes.set(xlabel="mean absolute speed error of held-out trials (mm/s)")
plt.show()

# %% [markdown]
# ## The answer
#
# What was put in, and how clearly it shows: its distance from the refitted twin without noise, in standard deviations.
# At 5 an effect is usually found. Another name than this would be a mistake: of names with a probability of 0.75 one in
# four is wrong.

# %%
answer = json.loads(Path("../datasets/withheld/small/answers/wc4264fc2.json").read_text())
{key: answer[key] for key in ("effects", "detectability")}
