"""
Steady states with all branches
===============================

Gears that lose contact have two stable states over a range of speeds: a run-up jumps at another
speed than a run-down. And where vibration would grow by itself while teeth stay in contact.
"""

import flexgear as fg
from flexgear.views.style import save_figure

model = fg.load_case("pair.toml").assemble()
bands = model.stability(speeds=(0.3, 1.5))
print("growth by itself from", bands.band_lower_factor.values, "to", bands.band_upper_factor.values)
data = model.response(speeds=(0.8, 1.4))
for speed, force in zip(data.turning_point_parameter, data.turning_point_force, strict=True):
    print(f"a sweep jumps at {float(speed):.4f} of rated speed, from {1e-3 * float(force):.1f} kN")
figure = data.fg.plot.response()
print("wrote", save_figure(figure, "response.png"))
