"""The most telling rows of the table of faults, flown and judged; `companion faults` flies all."""

import pytest

from companion.experiments.faults.flying import fly_order, orders
from companion.experiments.faults.table import chosen_rows, load_table

TELLING = (
    ("telemetry-pause", "ardupilot"),
    ("setpoints-lost", "px4"),
    ("link-lost", "ardupilot"),
    ("slow-link", "px4"),
    ("estimator-jump-large", "ardupilot"),
    ("mode-by-ground-station", "px4"),
    ("disarmed", "px4"),
)


@pytest.mark.faults
@pytest.mark.parametrize(("row", "autopilot"), TELLING)
def test_a_flight_that_is_hurt_ends_as_the_table_promises(row, autopilot, tmp_path):
    table = load_table()
    found = orders(table, chosen_rows(table, (row,)), tmp_path, seed=1)
    (order,) = (order for order in found if order.autopilot == autopilot)

    verdict = fly_order(order)

    assert verdict.judgement.broken == ()
    assert not order.folder.exists()  # the log of a flight that went well is not kept
    assert verdict.curves.fault_s == 0.0
