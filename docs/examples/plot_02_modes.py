"""
Natural modes of a planetary stage
==================================

The benchmark of Lin and Parker (1999): rotational modes, translational modes and planet modes.
"""

import flexgear as fg
from flexgear.views.style import save_figure

modes = fg.load_case("lin-parker", planets=5).assemble().modes()
for frequency, kind in zip(modes.frequency.values, modes.type.values, strict=True):
    print(f"{frequency:8.1f} Hz  {kind}")
figure = modes.fg.plot.modes()
print("wrote", save_figure(figure, "modes.png"))
