"""
A study over a parameter
========================

Any key of a case over values: here the natural frequencies over the planets' bearing stiffness.
"""

import numpy as np

import flexgear as fg

values = np.geomspace(2e7, 5e9, 9)
study = fg.sweep("lin-parker", {"stage.planet_bearing.radial_n_per_m": values}, workers=1)
for stiffness, frequencies in zip(values, study.frequency.values, strict=True):
    print(f"{stiffness:8.2e} N/m: second mode {frequencies[1]:7.1f} Hz")
figure = study.fg.plot.frequency()
figure.savefig("sweep.png")
print("wrote sweep.png")
