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
# # A robot of your own
#
# The built-in robot is one fish. Any swimmer with a crank, tendons and a tail of hinged segments can take its place: a
# text file describes it, and no code changes. This notebook goes from the numbers of a drawing to a twin that swims,
# and to a session that can be calibrated.
#
# The minnow below is made up: 0.37 m long, four segments, and tendons that stay on their sides.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import calib

# %matplotlib inline

# %% [markdown]
# ## 1. The drawing as a text file
#
# Lengths are in metres, masses in kilograms. x runs from the nose to the tail, z is up.
# `swimcal/robots/fish_057.toml` describes every key.

# %%
drawing = """
name = "minnow"
water = { density_kg_m3 = 998.0, viscosity_pa_s = 1.0e-3 }
tendons = { stiffness_n_m = 6000.0, damping_n_s_m = 60.0 }
elongated_body = { depth_m = 0.065, reference_area_m2 = 0.03 }

[head]                                      # boxes give mass and inertia, one ellipsoid the forces of the water
fluid_centre_m = [0.05, 0.0, 0.0]
fluid_half_size_m = [0.09, 0.018, 0.035]
part = [
    { name = "hull", centre_m = [0.05, 0.0, 0.0], half_size_m = [0.08, 0.018, 0.035], mass_kg = 0.45 },
    { name = "battery", centre_m = [0.02, 0.0, -0.01], half_size_m = [0.03, 0.012, 0.01], mass_kg = 0.20 },
]

[crank]                                     # the shaft lies across the hull, with an arm at each end
position_m = [0.10, 0.0, 0.0]
arm_m = 0.020
anchor_inset_m = 0.002
anchor_offset_m = 0.025
armature_kg_m2 = 0.03                       # from the data sheet of the motor
speed_gain_n_m_s = 50.0

[tail]
start_m = 0.14
hinge_stiffness_n_m = 0.35                  # a guess; notebook 03 measures it
hinge_damping_n_m_s = 0.015
density_kg_m3 = 1240.0                      # PLA
guide_inset_m = 0.004
segment = [
    { gap_m = 0.016, length_m = 0.022, thickness_m = 0.003, half_height_m = 0.034, guide_offset_m = 0.024 },
    { gap_m = 0.015, length_m = 0.020, thickness_m = 0.003, half_height_m = 0.031, guide_offset_m = 0.019 },
    { gap_m = 0.014, length_m = 0.018, thickness_m = 0.003, half_height_m = 0.028, guide_offset_m = 0.014 },
    { gap_m = 0.012, length_m = 0.016, thickness_m = 0.003, half_height_m = 0.025, guide_offset_m = 0.009 },
]

[caudal_fin]
gap_m = 0.008
length_m = 0.055
centre_m = 0.026
chord_m = 0.038
span_m = 0.13
thickness_m = 0.0015
mass_kg = 0.009

[markers]                                   # the part that carries it, and its place
nose = { body = "head", position_m = [-0.035, 0.0, 0.04] }
neck = { body = "head", position_m = [0.075, 0.0, 0.04] }
tail_1 = { body = "tail_1", position_m = [0.167, 0.0, 0.04] }
tail_2 = { body = "tail_2", position_m = [0.203, 0.0, 0.035] }
tail_3 = { body = "tail_3", position_m = [0.236, 0.0, 0.03] }
tail_4 = { body = "tail_4", position_m = [0.265, 0.0, 0.03] }
fin = { body = "tail_4", position_m = [0.325, 0.0, 0.05] }
"""
folder = Path(tempfile.mkdtemp())
file = folder / "minnow.toml"
file.write_text(drawing)
twin = calib.load_twin(file)
print(
    f"{twin.robot.name}: {twin.robot.length_m:.3f} m long, {twin.model.body_mass.sum():.2f} kg, {twin.model.nv} joints"
)

# %% [markdown]
# ## 2. Mistakes are found
#
# Everything that is wrong is said at once: here a length in millimetres, and a marker on a part that does not exist.

# %%
wrong = drawing.replace("arm_m = 0.020", "arm_m = 20").replace('fin = { body = "tail_4"', 'fin = { body = "tail_5"')
(folder / "wrong.toml").write_text(wrong)
try:
    calib.load_twin(folder / "wrong.toml")
except calib.InputError as faults:
    print(str(faults).replace(f"{folder}/", ""))

# %% [markdown]
# ## 3. Look at it
#
# Side views to one scale, the built-in fish above. White dots are hinges, red dots are markers.


# %%
def draw(axes, robot):
    """The robot from the side."""
    fin = robot.caudal_fin
    boxes = [(part.centre_m[::2], part.half_size_m[::2]) for part in robot.head.part]
    for x, segment in zip(robot.segment_x_m, robot.tail.segment, strict=True):
        boxes += [((x.mean(), 0), (np.ptp(x) / 2, segment.half_height_m))]
    boxes += [((robot.fin_root_x_m + fin.centre_m, 0), (fin.chord_m / 2, fin.span_m / 2))]
    for centre, half in boxes:
        corner, size = np.subtract(centre, half), np.multiply(2, half)
        axes.add_patch(plt.Rectangle(corner, *size, facecolor="#4c78a855", edgecolor="#4c78a8"))
    axes.plot(robot.hinge_x_m, 0 * robot.hinge_x_m, "o", color="black", markerfacecolor="white", markersize=4)
    axes.plot(*np.array([marker.position_m for marker in robot.markers.values()]).T[[0, 2]], ".", color="tab:red")
    axes.set(aspect="equal", ylabel="z (m)", title=f"{robot.name}, {robot.length_m:.2f} m")


fish = calib.load_twin()
figure, panels = plt.subplots(2, 1, figsize=(8, 6), sharex=True, sharey=True, layout="constrained")
for axes, each in zip(panels, (fish, twin), strict=True):
    draw(axes, each.robot)
axes.set(xlabel="x (m)")
plt.show()

# %% [markdown]
# ## 4. It swims
#
# Three frequencies, simulated together, from rest. The fluid coefficients are the published ones of the other fish;
# only a calibration gives those of this robot. The upper panel shows the body in twelve moments of one beat, from
# yellow to dark blue, the lower one the distance swum. A twin that starts from rest may also settle into swimming
# backward; the crank's phase at the start, `phase_rad`, decides.

# %%
hz = [0.5, 1.0, 1.5]
swim = twin.swim(hz, seconds=6.0)
beat = swim.position.isel(run=1, time=slice(240, 300, 5))
beat = beat.transpose("time", "space", "keypoint").values

figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5.5), layout="constrained")
for body, colour in zip(beat - beat[0, :, :1], plt.cm.viridis(np.linspace(0.9, 0.0, len(beat))), strict=True):
    above.plot(*body, color=colour)
above.set(aspect="equal", xlabel="x (m), swum from right to left", ylabel="y (m)", title="one beat at 1 Hz")
speeds = [f"{at} Hz: {1000 * speed:.0f} mm/s" for at, speed in zip(hz, swim.speed.values, strict=True)]
below.plot(swim.time, -100 * swim["head"].sel(space="x").T, label=speeds)
below.set(xlabel="time (s)", ylabel="distance (cm)", title="from rest")
below.legend()
plt.show()

# %% [markdown]
# How far a beat takes it, next to the built-in fish:

# %%
swims = {"minnow": (twin, swim), "fish_057": (fish, fish.swim(hz, seconds=6.0))}
per_beat = {name: swum.speed / swum.frequency / one.robot.length_m for name, (one, swum) in swims.items()}
pd.DataFrame(per_beat, index=pd.Index(hz, name="Hz")).round(3).rename_axis("body lengths a beat", axis=1)

# %% [markdown]
# ## 5. A session of it
#
# With `robot=` a session is one of this robot. Its tracks would come from videos; here the twin swims them, with half
# a pixel of noise.

# %%
random, tracks = np.random.default_rng(7), {}
for run, name in enumerate(("f0_50", "f1_00", "f1_50")):
    swum = swim.position.isel(run=run).sel(time=slice(1.0, None))
    pixels = 1000 * swum * [[1], [-1]] + [[1200], [600]] + 0.5 * random.standard_normal(swum.shape)  # y points down
    tracks[name] = pixels.assign_coords(time=swum.time - swum.time[0]).to_dataset(name="position")

session = calib.open_session(calib.new_session(folder / "pool", tracks=tracks, robot=file, fit=["f0_50", "f1_50"]))
calib.track(session).to_frame()[["frequency_hz", "speed", "used"]].round(4)

# %% [markdown]
# A calibration needs more than these three trials: a quick fit of them finds other coefficients than those that swam,
# and a constant stride forecasts the speed as well. Record the dry experiments (notebook 03) and several longer trials;
# then `calib.run(session)`.
#
# The same on the command line:
#
# ```sh
# calib mjcf minnow.toml --out minnow.xml
# calib new pool --tracks f0_50.csv f1_00.csv f1_50.csv --robot minnow.toml && calib doctor pool
# ```
