"""
What flexibility changes
========================

The same stage with its ring rigid: the same case, the same reduced bodies, one argument.
"""

import matplotlib.pyplot as plt
import numpy as np

import flexgear as fg

case = fg.load_case("stage.toml", {"solver.fidelity": "quick"})
angles = np.linspace(0.0, np.radians(10.0), 21)  # two tooth pitches of the ring
figure, axes = plt.subplots(layout="constrained")
for name, rigid in (("flexible", []), ("rigid ring", ["ring"]), ("all rigid", ["all"])):
    data = fg.stage_part(fg.static(fg.assemble(case, rigid=rigid), angles), "stage")
    loads = data.ring_pair_load.max(["planet", "slot"])
    axes.plot(np.degrees(angles), loads, label=name)
axes.set(xlabel="carrier (°)", ylabel="load of the most loaded ring tooth (N)")
axes.legend()
