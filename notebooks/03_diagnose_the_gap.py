# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#       jupytext_version: 1.19.6
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Diagnose the gap
#
# A calibrated twin still differs from the robot. Where, because of what, and how much of it goes away once that is in
# the model? `calib diagnose SESSION` answers in three sentences; here its parts are looked at one by one.
#
# The session is one of `datasets/withheld/small`. It was not made with the twin: a second simulator that shares no code
# with it swam, with something in it that the twin leaves out. What that was stands in an answer apart, which the last
# cell opens.

# %%
import json
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from calib import Options, Pipeline, open_session
from diagnosis.result import DIAGNOSIS
from diagnosis.sentences import sentences

# %matplotlib inline

# %%
suite, name = Path("../datasets/withheld/small"), "w31986ec6"
session = open_session(suite / "sessions" / name)
for trial in session.trials:
    print(f"{trial.name}: {trial.kind}, role {trial.role}, {trial.commanded_hz or 0:.2f} Hz commanded")

# %% [markdown]
# ## The three sentences
#
# The fitted swims say which effect; the others, which nothing was fitted to, how far it helps. Everything is written to
# `results/diagnosis.json`.

# %%
pipeline = Pipeline(session, Options(effort="quick"))
found = DIAGNOSIS.read(pipeline.diagnosis().parent)
for sentence in sentences(found):
    print(sentence)

# %% [markdown]
# ## Where
#
# Shares of what the nearest plain twin leaves, in units of all that disturbs the measurement. A share can be negative;
# the dot is what a stage would explain if it were the only one.

# %%
stages = found.where.by_stage
alone = found.stage_alone
figure, axes = plt.subplots(figsize=(7, 2.6))
axes.barh(list(stages), list(stages.values()), color="#4c78a8")
axes.plot([alone.get(stage, np.nan) for stage in stages], range(len(stages)), "o", color="#f58518")
axes.invert_yaxis()
axes.set(xlabel="share of the squared, whitened gap")
plt.show()

# %% [markdown]
# The same, as physics: the torque that is missing in each hinge over a turn of the crank, with two standard deviations.

# %%
forces = found.missing_forces
turn = np.linspace(0, 2 * np.pi, 120)
mean, sd = forces.over(turn)
hinges = [i for i, joint in enumerate(forces.joints) if joint.startswith("tail")]
figure, drawn = plt.subplots(1, len(hinges), figsize=(12, 2.4), sharey=True)
for axes, i in zip(drawn, hinges, strict=True):
    for line, width in zip(1000 * mean[:, i], 2000 * sd[:, i], strict=True):
        axes.plot(np.degrees(turn), line)
        axes.fill_between(np.degrees(turn), line - width, line + width, alpha=0.2)
    axes.set(title=forces.joints[i], xlabel="crank (°)", xticks=[0, 180, 360])
drawn[0].set(ylabel="missing torque (mN m)")
plt.show()

# %% [markdown]
# ## Which
#
# A probability for every effect of the catalogue, for something else, and for nothing at all.

# %%
chances = dict(list(found.chances.items())[:6]) | {
    "none of these": found.none_of_these,
    "nothing": found.no_gap_probability,
}
figure, axes = plt.subplots(figsize=(7, 2.8))
axes.barh([key.replace("_", " ") for key in chances], list(chances.values()), color="#54a24b")
axes.invert_yaxis()
axes.set(xlabel="probability", xlim=(0, 1))
plt.show()
print(found.verdict, found.groups)
for effect, fitted in found.effect_parameters.items():
    print(effect, fitted)

# %% [markdown]
# ## How far
#
# Both twins, refitted, on swims that neither has seen.

# %%
for trial, both in found.gap.trials.items():
    print(
        f"{trial}: markers {both.before_mm:5.1f} -> {both.after_mm:5.1f} mm, speed "
        f"{1000 * both.speed_before:6.1f} -> {1000 * both.speed_after:6.1f} mm/s "
        f"(measured {1000 * both.speed_measured:.1f})"
    )
print("shrinkage of the whitened gap:", found.gap.shrinkage, found.gap.shrinkage_ci95)

# %% [markdown]
# ## What it was
#
# `detectability` is how far the nearest other explanation is, in standard deviations; `alike` are effects that these
# data cannot tell from it.

# %%
answer = json.loads((suite / "answers" / f"{name}.json").read_text())
print(answer["kind"], answer["effects"], f"d = {answer['detectability']}", "alike:", answer["alike"])
