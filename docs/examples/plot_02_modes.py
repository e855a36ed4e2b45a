"""
Natural modes of a planetary stage
==================================

The benchmark of Lin and Parker (1999): modes turn, translate or move the planets alone.
"""

import flexgear as fg
from flexgear.views.mode_charts import modes_chart
from flexgear.views.style import save_figure

model = fg.assemble(fg.load_case("lin-parker", {"stage.planets": "5"}))
modes = fg.modes(model)
for frequency, kind in zip(modes.frequency.values, modes.type.values, strict=True):
    print(f"{frequency:8.1f} Hz  {kind}")
figure = modes_chart(modes)
print("wrote", save_figure(figure, "modes.png"))
