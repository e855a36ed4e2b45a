"""
Campbell diagram
================

Gear-mesh orders over speed, and where they meet the natural frequencies. With gyroscopic terms
the modes of the turning carrier split.
"""

import flexgear as fg
from flexgear.views.campbell_chart import campbell_chart
from flexgear.views.style import save_figure

case = fg.load_case("lin-parker", {"gyroscopic": "true", "inputs.0.speed_rpm": "6000"})
diagram = fg.campbell(fg.assemble(case), limit_hz=3000.0)
print(f"{diagram.sizes['crossing']} crossings up to the highest speed")
figure = campbell_chart(diagram)
print("wrote", save_figure(figure, "campbell.png"))
