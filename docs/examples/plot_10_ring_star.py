"""
The star of a flexible ring
===========================

Under N planets a ring bends into an N-pointed star that turns with the carrier. ``stage_part``
gives what belongs to one flexible stage as an xarray dataset.
"""

import matplotlib.pyplot as plt
import numpy as np

import flexgear as fg
from flexgear.views.style import save_figure

case = fg.load_case("stage.toml", {"solver.fidelity": "quick"})
static = fg.static(fg.assemble(case), np.radians([0.0, 15.0]))
ring = fg.stage_part(static, "stage")
orders = 1e6 * abs(fg.radial_harmonics(ring.tooth_displacement.values))
print(
    "largest order:",
    2 + orders[0, 2:12].argmax(),
    "of a stage with",
    case.stages[0].planets,
    "planets",
)

around = 2 * np.pi * np.arange(ring.sizes["tooth"] + 1) / ring.sizes["tooth"]
figure, axes = plt.subplots(subplot_kw={"projection": "polar"}, layout="constrained")
for k, angle in enumerate((0, 15)):
    radial = ring.tooth_displacement.values[k] @ np.eye(3)[:, :2]
    inward = 1e6 * (radial[:, 0] * np.cos(around[:-1]) + radial[:, 1] * np.sin(around[:-1]))
    axes.plot(around, np.append(inward, inward[0]) + 10, label=f"carrier at {angle}°")
axes.set_title("radial displacement of the teeth, 10 µm added")
axes.legend(loc="lower left")
print("wrote", save_figure(figure, "ring_star.png"))
