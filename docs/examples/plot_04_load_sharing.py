"""
Load sharing with eccentric gears
=================================

Eccentricities of sun, planets and carrier turn against each other, so each planet's share of the
load swings. Equilibria over two turns of the sun show by how much.
"""

import flexgear as fg
from flexgear.views.sharing_charts import sharing_chart
from flexgear.views.style import save_figure

model = fg.load_case("herringbone").assemble()
turns = model.static(range(0, 721, 12))
worst = turns.load_sharing.max("position")
print({str(g): round(float(v), 3) for g, v in zip(worst.group.values, worst.values, strict=True)})
figure = sharing_chart(turns)
print("wrote", save_figure(figure, "load_sharing.png"))
