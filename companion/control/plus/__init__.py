"""MPC-L1+: preview MPC and adaptation on the identified nominal plant of the vehicle.

`nominal_plant.py` the model; `predictor.py` the output predictor with its adaptation law; `lag.py`
and `mismatch.py` what is learnt of the vehicle in flight; `sensing.py` runs these at a sample;
`flatness.py` the input that the desired trajectory needs; `feedback.py` the optimum without
constraints; `constrained.py` the one with; `planner.py` chooses between them; `stack.py` joins all
to what the flight runs.
"""
