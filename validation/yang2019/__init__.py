"""Yang et al. 2019, double-rotor wind turbine gearbox, DOI 10.3390/en12214220.

Printed rules, where they differ from statics, are in printed_rules.py and nowhere else; what is
called consistent comes from flexgear.gears.power_flow on the bundled cases.
"""
