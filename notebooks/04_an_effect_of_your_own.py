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
# # An effect of your own
#
# The diagnosis knows 33 effects. Yours may be the 34th: a fin that has lost a piece, say. An effect is one small class
# that says what it is and how it enters the model; at zero it must be exactly the plain twin. This notebook writes one,
# looks at what it would do to a swim, and lets a diagnosis find it among others.
#
# The swims here are made by the twin itself, with the effect in it: enough to see that the class does what it should,
# no proof that it is found on a real robot. For that there is `calib benchmark effects`.

# %%
import matplotlib.pyplot as plt
import numpy as np

from diagnosis import Settings, diagnose, discrepancy_for
from fitting import measure_trial
from session import FISHSIM_MARKERS, CameraSpec, Tracks, TrialSpec
from swimmer import Twin, load_robot
from swimmer.effects import AffectedRuns, AffectedTwin, Effect, Parameter, catalogue

# %matplotlib inline

# %% [markdown]
# ## 1. The class
#
# `robot` is the way in for whatever changes the robot's description; there are also `mjcf` (anything in the model),
# `force` and `damping` (at every step), `drive` and `clock` (what the crank does, what the camera stamps) and `observe`
# (what camera and tracker see). `docs/effects.md` lists all of them.


# %%
class TornFin(Effect):
    """A share of the caudal fin's height is gone."""

    name = "torn_fin"
    family = "structure"
    stage = "tail"
    physics = "A lower fin pushes less water."
    source = "Looking at it."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("share", "1", 0.0, 0.8, 0.2),)

    def robot(self, robot, values):
        """With a lower fin."""
        fin = robot.caudal_fin.model_copy(update={"span_m": robot.caudal_fin.span_m * (1 - values[0])})
        return robot.model_copy(update={"caudal_fin": fin})


torn_fin = TornFin()

# %% [markdown]
# ## 2. What it does to a swim
#
# A twin with effects takes their values with each run, so a whole sweep is one batch.

# %%
robot = load_robot()
twin = Twin(robot, FISHSIM_MARKERS)
affected = AffectedTwin(twin, [torn_fin])
shares = np.linspace(0.0, 0.6, 7)
water = (0.6, 3.0, 6.0, 4.0, 1.5)  # blunt, slender and angular drag, Kutta and Magnus lift

runs = AffectedRuns(
    coefficients=np.tile(water, (len(shares), 1)),
    frequency_hz=np.full(len(shares), 1.0),
    phase_rad=np.zeros(len(shares)),
    velocity=np.tile([-0.1, 0.0, 0.0], (len(shares), 1)),
    values=shares[:, None],
)
time_s = np.arange(0.0, 6.0, 1 / 60)
swims = affected.simulate(runs, time_s)
late = time_s >= 3.0
speed = -np.polyfit(time_s[late], swims.head[:, late, 0].T, 1)[0]

figure, axes = plt.subplots(figsize=(6, 3))
axes.plot(100 * shares, 1000 * speed, "o-")
axes.set(xlabel="share of the fin that is gone (%)", ylabel="speed (mm/s)", title="1 Hz, along the first heading")
plt.show()

# %% [markdown]
# ## 3. Three swims of a robot with a torn fin
#
# As a tracker would give them: pixels, half a pixel of noise that lasts a few frames.

# %%
camera = CameraSpec(fps=60.0, scale_length_m=robot.scale_length_m)
metres_per_px, random = 0.001, np.random.default_rng(2)


def filmed(hz: float, role: str):
    """One swim with a third of the fin gone."""
    run = AffectedRuns(
        np.array([water]), np.array([hz]), np.zeros(1), np.array([[-0.1 * hz, 0.0, 0.0]]), values=np.array([[0.35]])
    )
    marker_m = affected.simulate(run, time_s).marker_m[0]
    noise = np.zeros_like(marker_m)
    for frame in range(1, len(noise)):
        noise[frame] = 0.85 * noise[frame - 1] + 0.25 * random.standard_normal(noise.shape[1:])
    position_px = marker_m / metres_per_px * [1, -1] + 1500 + noise
    tracks = Tracks(FISHSIM_MARKERS, time_s, position_px, np.ones(position_px.shape[:2]))
    spec = TrialSpec(f"f{hz:.2f}".replace(".", "_"), "swim", commanded_hz=hz, role=role)
    return measure_trial(spec, tracks, camera, robot, 1.0)


trials = [filmed(0.7, "fit"), filmed(1.2, "fit"), filmed(1.0, "holdout")]
for trial in trials:
    print(f"{trial.name} ({trial.role}): {trial.frequency.hz:.3f} Hz, {1000 * trial.speed:.0f} mm/s")

# %% [markdown]
# ## 4. Found among others?
#
# The new effect beside some of the catalogue. (All 33 take half a minute; `calib diagnose` does that.)

# %%
some = ("crank_arm_error", "stiffness_error", "added_mass_reaction", "segment_coefficients")
effects = {name: catalogue()[name] for name in some} | {"torn_fin": torn_fin}
found = diagnose(trials, twin, camera, effects, discrepancy_for(FISHSIM_MARKERS, robot), Settings("quick"))
chances = dict(zip(found.probabilities.names, found.probabilities.marginal, strict=True))
print(found.verdict.name, found.verdict.groups)
for name, chance in sorted(chances.items(), key=lambda item: -item[1]):
    print(f"{name:24} {chance:.2f}")

# %%
if found.refit is not None and "torn_fin" in found.refit.by_effect:
    print(f"share that is gone: {found.refit.by_effect['torn_fin'][0]:.2f} (0.35 in the robot that swam)")
assert found.gap is not None
for before, after in zip(found.gap.before, found.gap.after, strict=True):
    print(f"{before.name}: markers {1000 * before.marker_error_m:.1f} -> {1000 * after.marker_error_m:.1f} mm")

# %% [markdown]
# ## 5. For good
#
# In a package of your own, the entry point below puts the effect into every catalogue, and so into `calib diagnose`:
#
# ```toml
# [project.entry-points."swimcal.effects"]
# torn_fin = "my_package.torn_fin:TornFin"
# ```
#
# `tests/swimmer/effects/test_catalogue.py` shows what every effect has to hold: at zero the plain twin to the bit, each
# parameter does something, nothing diverges within the bounds.
