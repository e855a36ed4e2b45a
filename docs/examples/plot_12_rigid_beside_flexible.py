"""
What flexibility changes
========================

The same stage with a rigid ring, and with all bodies rigid: one method of the model.
"""

import numpy as np

import flexgear as fg
from flexgear.views.style import save_figure

model = fg.load_case("stage.toml", {"solver.fidelity": "quick"}).assemble()
angles = np.linspace(0.0, 10.0, 21)  # ° of the carrier: two tooth pitches of the ring
models = {"flexible": model, "rigid_ring": model.rigid("ring"), "rigid": model.rigid()}
both = fg.compare(**{name: m.static(angles) for name, m in models.items()})
print(both)
figure = both.plot()
print("wrote", save_figure(figure, "rigid_beside_flexible.png"))
