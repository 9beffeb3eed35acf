"""PX4 in software: its modes, its rules for arming and failsafe, its control structure.

The behaviour on the wire follows measurements of PX4 v1.17; the control laws, their parameter
names and their defaults are PX4's (docs.px4.io, "Controller Diagrams" and "Parameter Reference").
"""
