"""A log's bytes: the same whether they are few or many, and not in memory when they are many."""

import tracemalloc

from sitl_shim.mavlink.services.log_bytes import LogBytes


def test_bytes_are_read_as_they_were_written_from_anywhere():
    log = LogBytes()
    written = b""
    for k in range(4000):
        row = bytes([k % 256]) * 100
        log.append(row)
        written += row
        if k % 500 == 0:  # reading in between does not disturb the writing
            assert log.read(0, 50) == written[:50]
    assert len(log) == len(written) == 400_000
    assert log.read(0, len(log)) == written
    assert log.read(123_456, 123_556) == written[123_456:123_556]


def test_reading_ends_where_the_log_does():
    log = LogBytes()
    log.append(b"abc")
    assert (log.read(1, 90), log.read(3, 9), log.read(7, 9)) == (b"bc", b"", b"")


def test_a_long_log_takes_no_memory():
    log = LogBytes()
    row = bytes(1000)
    for _ in range(300):
        log.append(row)
    tracemalloc.start()
    try:
        for _ in range(3000):
            log.append(row)
        assert tracemalloc.get_traced_memory()[0] < 20_000
    finally:
        tracemalloc.stop()
    assert len(log) == 3_300_000
