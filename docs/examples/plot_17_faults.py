"""
Faults of teeth
===============

Effect of a cracked root and of a pit in one tooth of the sun on the sun's rotation. Each time the
tooth meets one of the four planets, the sun lags behind its rotation with sound teeth: over the
crack because the tooth bends more, over the pit because material is missing.
"""

import numpy as np
from matplotlib import pyplot as plt

import flexgear as fg
from flexgear.views.style import save_figure

case = fg.load_case("stage.toml", {"solver.fidelity": "quick"})
tooth = {"gear": "sun", "tooth": 1, "flank": "drive"}
faults = {  # depths in m
    "root crack, 0.9 mm": {"kind": "root_crack", "depth": 9e-4, **tooth},
    "spall, 2 µm": {"kind": "spall", "depth": 2e-6, **tooth},
}
angles = np.linspace(0.0, 90.0, 541)  # ° of the carrier
base_radius = 0.5 * 28 * 1.5e-3 * np.cos(np.radians(20.0))


def rotation(faulty):
    """Of the sun at its base circle beside rolling, µm."""
    motion = faulty.assemble(rigid="all").static(angles)["body_displacement"]
    return 1e6 * base_radius * motion.sel(body="stage.sun", dof="rz").to_numpy()


sound = rotation(case)
figure, axis = plt.subplots(figsize=(9, 4))
for label, fault in faults.items():
    change = rotation(case.with_(faults=(fault,))) - sound
    print(f"{label}: the sun lags by up to {np.abs(change).max():.2f} µm")
    axis.plot(angles, change, label=label)
axis.set(xlabel="carrier angle / °", ylabel="change of the sun's rotation / µm")
axis.set_title("Sun against sound teeth, at its base circle: once a planet (35° apart)")
axis.legend(loc=(0.2, 0.05))
print("wrote", save_figure(figure, "faults.png"))
