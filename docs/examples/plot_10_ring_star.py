"""
The star of a flexible ring
===========================

Under N planets a ring bends into an N-pointed star that turns with the carrier. ``fg.plot`` of a
result draws the pictures of ``flexgear run`` by their names; ``stage_part`` gives the part of one
flexible stage as an xarray dataset.
"""

import flexgear as fg
from flexgear.views.style import save_figure

case = fg.load_case("stage.toml", {"solver.fidelity": "quick"})
static = case.assemble().static(angle_deg=[0, 15])
ring = fg.stage_part(static, "stage")
orders = abs(fg.radial_harmonics(ring.tooth_displacement.values))
print(f"largest order: {2 + orders[0, 2:12].argmax()}, planets: {case.stages[0].planets}")
figure = static.fg.plot.ring_star()
print("wrote", save_figure(figure, "ring_star.png"))
