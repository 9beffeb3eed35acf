"""The MPC's quadratic programme, tick by tick: one problem, its recorded inputs, many solvers."""
