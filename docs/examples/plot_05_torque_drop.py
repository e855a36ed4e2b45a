"""
A torque drop in time
=====================

The torque of the drive falls to a tenth for a fiftieth of a second; tooth pairs may separate.
"""

import flexgear as fg
from flexgear.views.sharing_charts import gear_mesh_forces
from flexgear.views.style import save_figure

drop = {"kind": "steps", "times_s": [0, 0.01, 0.03], "torques_nm": [100, 10, 100]}
case = fg.load_case("lin-parker", {"gear_mesh.contact_law": "one-sided"}, drive=drop)
run = case.assemble().transient(duration=0.05)
print(f"least force of a gear mesh: {run.gear_mesh_force.min().item():.0f} N")
figure = gear_mesh_forces(run)
print("wrote", save_figure(figure, "torque_drop.png"))
