"""Numbers that would fill the memory or never come to an end are refused."""

import pytest

from sitl_shim.data_file import DataFileError
from sitl_shim.faults.schema import load_faults


@pytest.mark.parametrize(
    ("entry", "key"),
    [
        ("babble_packets_s: 100001.0", "babble_packets_s"),
        ("babble_packets_s: 1000000000000.0", "babble_packets_s"),
        ("bursts: {every_s: 0.000000001, length_s: 1.0}", "every_s"),
        ("bursts: {every_s: 1.0, length_s: 0.000000001}", "length_s"),
        ("delay_s: 60.1", "delay_s"),
        ("jitter_s: 60.1", "jitter_s"),
        ("reorder_by_s: 60.1", "reorder_by_s"),
    ],
)
def test_what_no_computer_could_do_is_refused_by_its_key(entry: str, key: str) -> None:
    with pytest.raises(DataFileError, match=key):
        load_faults(f"{{link: [{{{entry}}}]}}")


def test_the_bounds_themselves_are_possible() -> None:
    faults = load_faults(
        "{link: [{babble_packets_s: 100000.0, bursts: {every_s: 0.001, length_s: 0.001},"
        " delay_s: 60.0, jitter_s: 60.0, reorder_by_s: 60.0}]}"
    )
    (link,) = faults.link
    assert (link.babble_packets_s, link.delay_s) == (1e5, 60.0)
