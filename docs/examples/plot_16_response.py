"""
Steady states with all branches
===============================

Gears that lose contact have two stable states over a range of speeds: a run-up jumps at another
speed than a run-down. One curve holds both, and the unstable states between them.
"""

import flexgear as fg
from flexgear.views.style import save_figure

model = fg.load_case("pair.toml").assemble()
data = model.response(speeds=(0.9, 1.4))
for speed, force in zip(data.turning_point_parameter, data.turning_point_force, strict=True):
    print(f"a sweep jumps at {float(speed):.4f} of rated speed, from {1e-3 * float(force):.1f} kN")
figure = data.fg.plot.response()
print("wrote", save_figure(figure, "response.png"))
