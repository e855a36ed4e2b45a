"""
A run-up and its order map
==========================

A sun speeds up from 600 to 2400 r/min. Over the rotation of the carrier, excitation by gear meshes
stays at its orders; amplitudes are high where an order meets a natural frequency of the train with
its sun held, as its speed is prescribed: the second order a rotational mode, the third a planet
mode.
"""

import numpy as np

import flexgear as fg
from flexgear.results.run_orders import expected_orders
from flexgear.views.order_charts import order_map_chart
from flexgear.views.style import save_figure

case = fg.load_case(
    "lin-parker",
    {
        "stage.gear_mesh.model": "fourier",
        "solver.time_step_s": "2.5e-5",
        "solver.output_interval_ms": "0.05",
        "inputs.0.machine.law": "speed",
        "inputs.0.machine.kind": "ramp",
        "inputs.0.machine.times_s": "[0, 2]",
        "inputs.0.machine.speeds_rpm": "[600, 2400]",
    },
)
run = case.assemble().transient(duration=2.0).sel(gear_mesh="stage sun 1")
orders = run.fg.order_map("gear_mesh_force", "carrier", highest=300, block_turns=0.5)
figure = order_map_chart(orders, expected_orders(case, "carrier"), "Force of sun and planet 1")
for harmonic in (2, 3):
    ridge = orders.sel(order=94 * harmonic, method="nearest")
    speed = ridge.speed[int(ridge.to_numpy()[4:].argmax()) + 4].item() / (2 * np.pi)
    print(f"order {harmonic} of the gear mesh is highest at {94 * harmonic * speed:.0f} Hz")
print("wrote", save_figure(figure, "run_up.png"))
