"""
Sidebands of a measured gearbox
===============================

A test rig with public tooth counts: sun 31, three planets of 31, ring of 95 at rest. Around the
first harmonic of the gear mesh its published order spectra (`SNU-PLANETARY
<https://huggingface.co/datasets/AI4Manufacturing/SNU-PLANETARY-annotated>`_, 917 records; read:
the description, which states heights over that of the gear-mesh line at order 95) have

====================  ============  ============
state                 order 94      order 96
====================  ============  ============
healthy               0.92 to 1.11  0.10 to 0.36
fault of the sun      0.86 to 1.18  0.40 to 1.20
fault of a planet     1.70 to 3.71  not stated
====================  ============  ============

The rule: three equal planets leave the orders that three divides, here 93 and 96; 94 and
95 are there only as planets differ, both by the same share if they differ in size alone. Below is
the force on the ring's support in a stage with these teeth, with equal planets and with one pin
20 µm off. A rigid ring has sidebands of one pass only; profile shifts, masses and stiffnesses are
assumed, so compare positions of lines, not heights.

Agrees: 94 is as high as 95 in the healthy rig; a fault of the sun, which meets all planets alike,
leaves their ratio as it is and raises 96; a fault of one planet changes the ratio. Does not
agree: 96 is the lowest of the three in the measurement, where the rule has it highest. So the
planets of the rig differ, or its sensor signal depends on more than the pass of a planet; the
description does not say which. It has no amplitudes in physical units.

Others: asymmetric sidebands and gear-mesh lines that are missing were found in several gearboxes,
in agreement with the rule (McFadden and Smith 1985, Proc. IMechE 199C:65, read: the abstract). In
two helicopters' transmissions in flight large lines stood where the rule has them; finer details
of the model, and what seeded faults would do, were not found (Mosher 2003, doi
10.1115/DETC2003/PTG-48082, read: the abstract).
"""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import flexgear as fg
from flexgear.results.orders import amplitudes_at
from flexgear.results.run_orders import history_over_turns
from flexgear.views.style import save_figure

RIG = {  # profile shifts and the free centre distance make these teeth fit
    "stage.planets": "3", "stage.sun.teeth": "31", "stage.planet.teeth": "31",
    "stage.ring.teeth": "95", "stage.sun.profile_shift": "0.3",
    "stage.planet.profile_shift": "0.25", "stage.ring.profile_shift": "0.2",
    "stage.center_distance_mm": "92.876",
    "stage.pressure_angle_deg": "20", "stage.sun_pressure_angle_deg": "",
    "stage.ring_pressure_angle_deg": "", "stage.gear_mesh.model": "fourier",
    "solver.time_step_s": "1e-4",
}  # fmt: skip
ORDERS = np.arange(92, 99)


def heights(pin_um: float) -> xr.DataArray:
    """Amplitudes of the force on the ring's support across the axis in space, by order."""
    case = fg.load_case(
        "lin-parker", {**RIG, "stage.errors.pin_tangential_um": f"[{pin_um}, 0, 0]"}
    )
    run = case.assemble().transient(duration=1.6)
    angle = run.carrier_angle.isel(turning_stage=0)
    run = run.isel(time=((angle > 2 * np.pi) & (angle < 10 * np.pi)).to_numpy())
    force = run.bearing_force.sel(support="stage.ring_support")
    angle = run.carrier_angle.isel(turning_stage=0)  # the force is given in axes of the carrier
    fixed = force.sel(dof="ux") * np.cos(angle) - force.sel(dof="uy") * np.sin(angle)
    return amplitudes_at(history_over_turns(run.assign(force=fixed), "force", "carrier"), ORDERS)


alike, unequal = heights(0.0), heights(20.0)
figure = Figure(figsize=(7, 3), layout="constrained")
axes = figure.add_subplot()
axes.bar(ORDERS - 0.2, alike, 0.4, label="three planets alike")
axes.bar(ORDERS + 0.2, unequal, 0.4, label="pin of planet 1 off by 20 µm")
axes.set(xlabel="order of the carrier; gear mesh 95", ylabel="force on the ring's support (N)")
axes.set_yscale("log")
axes.set_ylim(1e-6 * float(unequal.max()), 10 * float(unequal.max()))
axes.legend()
for name, lines in (("alike", alike), ("one pin off", unequal)):
    over = {o: lines.sel(order=o).item() / lines.sel(order=96).item() for o in (93, 94, 95)}
    print(f"{name}, over order 96: " + ", ".join(f"{o} {h:.1e}" for o, h in over.items()))
print("wrote", save_figure(figure, "measured_sidebands.png"))
