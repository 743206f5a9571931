# %% [markdown]
# # A first scan
# From a ready-made weld seam to the error of every point, then another exposure, another method, and a scene of one's
# own. Every cell takes seconds at this image scale; at 1.0 the figures are the scanner's.

# %%
import numpy as np

import studio as blazer

SCALE = 0.2

# %% [markdown]
# ## Render once
# Each laser and the ambient light are rendered apart, to the error that is requested, with the exact line beside them.

# %%
project = blazer.Project.load("weld_seam")
frame = blazer.render(project, error=0.01, image_scale=SCALE)
for step in frame.plan.steps:
    print(step.group, step.name, "computed" if step.computed else "left out", step.reason)
for group in frame.quality:
    print(f"{group.laser or 'all'}, {group.group}: error {group.error:.2%}, target {group.target:.2%}")
frame.show()

# %% [markdown]
# ## Develop, find the line, triangulate, compare

# %%
image = blazer.develop(frame)
line = blazer.extract(image, method="likelihood")
points = blazer.triangulate(line)
errors = blazer.compare(points, frame)
print(f"depth RMSE {1e6 * errors.depth_z.rmse:.0f} um, {errors.completeness:.1%} of the line measured")
errors.plot()

# %%
image.show(line)

# %% [markdown]
# ## Another laser power, without rendering again
# The frame holds radiance, so power, exposure, noise and bit depth are settled when it is developed.

# %%
for power in (0.005, 0.02, 0.08):
    weak = blazer.develop(frame, power=power)
    found = blazer.compare(blazer.triangulate(blazer.extract(weak)), frame)
    print(f"{1e3 * power:4.0f} mW: robust sigma {1e6 * found.depth_z.robust_sigma:.0f} um, {found.completeness:.1%}")

# %% [markdown]
# ## Methods beside each other

# %%
for method in ("likelihood", "gaussian", "centre_of_mass", "steger"):
    found = blazer.compare(blazer.triangulate(blazer.extract(image, method=method)), frame)
    print(f"{method:16s} line {found.u.rmse:.3f} px RMSE, bias {found.u.bias:+.3f} px")

# %% [markdown]
# ## A line in any array
# A photograph, or here a line drawn with numpy; the noise is estimated from the image.

# %%
u, v = np.arange(200.0), np.arange(100.0)
true = 90.0 + 0.1 * v
noise = np.random.default_rng(1).normal(0.0, 2.0, (100, 200))
drawn = (20.0 + 150.0 * np.exp(-0.5 * ((u[None, :] - true[:, None]) / 1.8) ** 2) + noise).clip(0, 255).astype(np.uint8)
found_line = blazer.extract(drawn, method="gaussian")
print(f"{np.nanstd(found_line.u[:, 0] - true):.3f} px of scatter, {np.nanmean(found_line.sigma_u):.3f} px predicted")

# %% [markdown]
# ## A scene made in Python
# Metres, radians, watts. Camera and laser look down at a sphere; the laser stands 0.2 m beside the camera and is turned
# towards the middle of the picture.

# %%
lens = blazer.Lens(f_number=8.0)
camera = blazer.Camera(width=400, height=320, fx=700.0, fy=700.0, cx=199.5, cy=159.5, pixel_pitch=20e-6, lens=lens)
laser = blazer.LineLaser(
    power=0.02, T_rig_laser=blazer.Pose(translation=(0.2, 0.0, 0.0), rotation=(0.0, -np.arctan(0.2 / 0.8), 0.0))
)
ball = blazer.SceneObject(
    name="ball", shape=blazer.Sphere(radius=0.1), T_world_object=blazer.Pose(translation=(0.0, 0.0, 0.8))
)
own = blazer.Project(
    name="A ball",
    scene=blazer.Scene(rig=blazer.Rig(camera=camera, lasers=(laser,)), objects=(ball,)),
    sensor=blazer.Sensor(exposure_time=2e-4),
)
own_frame = blazer.render(own, error=0.02)
own_image = blazer.develop(own_frame)
own_line = blazer.extract(own_image)
own_points = blazer.triangulate(own_line)
own_errors = blazer.compare(own_points, own_frame)
print(own_errors)

# %%
blazer.write_report("ball.html", own_frame, own_image, own_line, own_points, own_errors)
