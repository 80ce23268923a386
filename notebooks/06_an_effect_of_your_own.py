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
# # An effect of your own
#
# The diagnosis knows the effects in `calib.effects()`. You can add your own, for example a fin that has lost a piece.
# An effect is one small class that describes it and how it enters the model. At zero it must equal the plain twin
# exactly. This notebook writes one, looks at what it does to a swim, and lets a diagnosis find it among others.
#
# The swims here are made by the twin itself, with the effect in it. That shows that the class does what it should; it
# is no proof that the effect is found on a real robot. For that there is `python -m benchmarks effects`.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import calib

# %matplotlib inline

# %% [markdown]
# ## 1. The class
#
# `robot` is the method for whatever changes the robot's description; there are also `mjcf` (anything in the model),
# `force` and `damping` (at every step), `drive` and `clock` (what the crank does, what the camera stamps) and
# `observe` (what camera and tracker see). `docs/effects.md` describes them.


# %%
class TornFin(calib.Effect):
    """A share of the caudal fin's height is gone."""

    name = "torn_fin"
    family = "structure"
    stage = "tail"
    physics = "A lower fin pushes less water."
    source = "Looking at it."
    seen_in = frozenset({"swim"})
    parameters = (calib.Parameter("share", unit="1", low=0.0, high=0.8, sd=0.2),)

    def robot(self, robot, values):
        """Lower the fin."""
        fin = robot.caudal_fin.model_copy(update={"span_m": robot.caudal_fin.span_m * (1 - values[0])})
        return robot.model_copy(update={"caudal_fin": fin})


# %% [markdown]
# ## 2. What it does to a swim
#
# A sweep is one batch, simulated on all cores.

# %%
water = (0.6, 3.0, 6.0, 4.0, 1.5)  # blunt, slender and angular drag, Kutta and Magnus lift
twin = calib.load_twin(coefficients=water, effects=[TornFin()])
share = np.linspace(0.0, 0.6, 7)
swim = twin.swim(1.0, seconds=6.0, parameters={"torn_fin.share": share})

figure, axes = plt.subplots(figsize=(6, 3))
axes.plot(100 * share, 1000 * swim.speed, "o-")
axes.set(xlabel="share of the fin that is gone (%)", ylabel="speed (mm/s)", title="at 1 Hz")
plt.show()

# %% [markdown]
# ## 3. Three swims of a robot with a torn fin
#
# As a tracker would give them: pixels, with half a pixel of noise that lasts a few frames.

# %%
random, metres_per_px = np.random.default_rng(2), 0.001
markers = list(calib.open_session("../datasets/sample").markers)
tracks = {}
for hz in (0.7, 1.0, 1.2):
    swum = twin.swim(hz, seconds=8.0, parameters={"torn_fin.share": 0.35}).isel(run=0)
    swum = swum.sel(time=slice(2.0, None), keypoint=markers)
    swum = swum.assign_coords(time=swum.time - swum.time[0])
    noise = np.zeros(swum.position.shape)
    for frame in range(1, len(noise)):
        noise[frame] = 0.85 * noise[frame - 1] + 0.25 * random.standard_normal(noise.shape[1:])
    upward = swum.position / metres_per_px + noise
    upward.loc[{"space": "y"}] *= -1  # y of a picture points down
    tracks[f"f{hz:.2f}".replace(".", "_")] = (upward + 1500).to_dataset(name="position")

folder = Path(tempfile.mkdtemp()) / "torn"
session = calib.open_session(calib.new_session(folder, tracks=tracks, fit=["f0_70", "f1_20"]))
calib.track(session).to_frame()[["frequency_hz", "speed", "used"]].round(3)

# %% [markdown]
# ## 4. Found among others?
#
# The new effect among some of the catalogue. (With all it takes half a minute.)

# %%
some = ["crank_arm_error", "stiffness_error", "added_mass_reaction", "segment_coefficients"]
gap = calib.diagnose(session, effort="quick", effects=[*some, TornFin()])
gap.effects.to_frame()

# %%
gap.to_frame("trials").T.round(3)

# %% [markdown]
# The share that is gone is 0.35 in the robot that swam.
#
# ## 5. Install it
#
# In a package of your own, the entry point below puts the effect into every catalogue, and so into `calib diagnose`:
#
# ```toml
# [project.entry-points."swimcal.effects"]
# torn_fin = "my_package.torn_fin:TornFin"
# ```
#
# `tests/swimcal/effects/test_catalogue.py` shows what every effect has to fulfil: at zero the plain twin to the bit,
# each parameter does something, nothing diverges within the bounds.
