"""
What flexibility changes
========================

The same stage with its ring rigid: the same case, one argument.
"""

import matplotlib.pyplot as plt
import numpy as np

import flexgear as fg
from flexgear.views.style import save_figure

case = fg.load_case("stage.toml", {"solver.fidelity": "quick"})
angles = np.linspace(0.0, np.radians(10.0), 21)  # two tooth pitches of the ring
figure, axes = plt.subplots(layout="constrained")
for name, rigid in (("flexible", []), ("rigid ring", ["ring"]), ("all rigid", ["all"])):
    data = fg.stage_part(fg.static(fg.assemble(case, rigid=rigid), angles), "stage")
    ring = data.isel(flank=data.flank_kind.values == "ring")
    loads = ring.pair_load.max(["flank", "slot"])
    axes.plot(np.degrees(angles), loads, label=name)
    print(f"{name}: {loads.max().item():.0f} N on the most loaded ring tooth")
axes.set(xlabel="carrier (°)", ylabel="load of the most loaded ring tooth (N)")
axes.legend()
print("wrote", save_figure(figure, "rigid_beside_flexible.png"))
