"""
A machine with a speed controller
=================================

The output is a generator that holds its speed by a proportional and integral law while the drive
steps from full torque to half of it.
"""

import matplotlib.pyplot as plt

import flexgear as fg
from flexgear.views.style import save_figure

case = fg.load_case(
    "lin-parker",
    {"inputs.0.inertia_kg_m2": 0.02, "output.inertia_kg_m2": 0.5},
    drive={"kind": "steps", "times_s": [0, 0.05], "torques_nm": [100, 50]},
    output__machine={"law": "controller", "kp_nm_s_per_rad": 40, "ki_nm_per_rad": 800},
)
run = case.assemble().transient(duration=0.3)
figure, axes = plt.subplots(2, 1, sharex=True, layout="constrained")
axes[0].plot(run.time, 9.5493 * run.port_speed.isel(port=-1))
axes[0].set_ylabel("carrier (r/min)")
axes[1].plot(run.time, run.port_torque.isel(port=-1))
axes[1].set(xlabel="time (s)", ylabel="generator (N m)")
print(f"carrier after 0.3 s: {9.5493 * run.port_speed.isel(port=-1)[-1].item():.2f} r/min")
print("wrote", save_figure(figure, "machine.png"))
