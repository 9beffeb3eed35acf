"""MPC-L1+: preview MPC and adaptation on the identified nominal plant of the vehicle.

`nominal_plant.py` the model; `predictor.py` the output predictor with its adaptation law;
`flatness.py` the input that the desired trajectory needs; `feedback.py` the optimum without
constraints; `constrained.py` the one with; `lag.py` the attitude's lag as it is in flight;
`stack.py` joins them to what the flight runs.
"""
