"""
The deformed ring in space
==========================

Displacements of every vertex are recovered from the reduced body; pyvista draws them.
"""

import flexgear as fg
from flexgear.views.render import render_deformed
from flexgear.views.style import save_figure

model = fg.load_case("stage.toml", {"solver.fidelity": "quick"}).assemble()
field = model.deformed("stage.ring")
print(
    f"largest: {1e6 * field.displacement.max().item():.1f} µm at {field.sizes['vertex']} vertices"
)
figure = render_deformed(field.point.values, field.cell.values, field.displacement.values)
print("wrote", save_figure(figure, "deformed_ring.png"))
