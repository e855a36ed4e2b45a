"""
Campbell diagram
================

Gear-mesh orders over speed, and where they meet the natural frequencies. With gyroscopic terms
the modes of the turning carrier split.
"""

import flexgear as fg
from flexgear.views.style import save_figure

case = fg.load_case("lin-parker", {"inputs.0.speed_rpm": 6000}, gyroscopic=True)
modes = case.assemble().modes(limit_hz=3000.0)
print(f"{modes.sizes['crossing']} crossings up to the highest speed")
figure = modes.fg.plot.campbell()
print("wrote", save_figure(figure, "campbell.png"))
