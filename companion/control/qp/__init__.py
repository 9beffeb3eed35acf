"""Quadratic programmes behind one small port (`port.py`), one file per solver."""
