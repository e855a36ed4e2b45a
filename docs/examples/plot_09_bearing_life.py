"""
Life of planet bearings over torque
===================================

Basic rating life by ISO 281 from the power flow: the load on a pin and the planet's speed on it.
"""

import matplotlib.pyplot as plt

import flexgear as fg
from flexgear.gears.bearings.nominal import nominal_bearings
from flexgear.views.style import save_figure

rating = {"stage.planet_bearing.dynamic_rating_kn": 18, "stage.planet_bearing.rolling": "roller"}
torques = [60, 80, 100, 130, 170]
hours = []
for torque in torques:
    case = fg.load_case("lin-parker", {**rating, "inputs.0.torque_nm": torque})
    bearings = nominal_bearings(case.view(), fg.power_flow(case).stage("stage"))
    hours.append(bearings["planet_bearing"].life_hours)
figure, axes = plt.subplots(layout="constrained")
axes.loglog(torques, hours, "o-")
axes.set(xlabel="torque of the sun (N m)", ylabel="L10h of a planet bearing (h)")
for torque, life in zip(torques, hours, strict=True):
    print(f"{torque:4d} N m: L10h = {life:8.0f} h")
print("wrote", save_figure(figure, "bearing_life.png"))
