"""Steps of simulations alone, for `benchmarks/lockstep.py`."""
