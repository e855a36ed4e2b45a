"""
Speeds, torques and powers of a gearbox
=======================================

Tooth numbers and the given speeds and torques at the ports define the power flow, in closed form.
"""

import flexgear as fg
from flexgear.views.sharing_charts import power_flow_chart
from flexgear.views.style import save_figure

case = fg.load_case("nrel-5mw")
flow = fg.power_flow(case)
print(f"{flow.input_power / 1e6:.2f} MW come in; {flow.mobility} speed can be chosen")
figure = power_flow_chart(flow)
print("wrote", save_figure(figure, "power_flow.png"))
