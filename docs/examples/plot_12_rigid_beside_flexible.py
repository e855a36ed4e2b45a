"""
What flexibility changes
========================

A stage whose first pin is 20 µm ahead, with a rigid ring, and with all bodies rigid: bodies that
bend share the load more evenly.
"""

import numpy as np

import flexgear as fg
from flexgear.views.style import save_figure

pin = {"stage.errors.pin_tangential_um": [20, 0, 0, 0]}
model = fg.load_case("stage.toml", {"solver.fidelity": "quick", **pin}).assemble()
angles = np.linspace(0.0, 10.0, 21)  # ° of the carrier: two tooth pitches of the ring
models = {"flexible": model, "rigid_ring": model.rigid("ring"), "rigid": model.rigid()}
both = fg.compare(**{name: m.static(angles) for name, m in models.items()})
print(both)
figure = both.plot()
print("wrote", save_figure(figure, "rigid_beside_flexible.png"))
