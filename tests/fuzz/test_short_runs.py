"""Each target of tools/fuzz with a few thousand inputs of fixed seeds, and the tool itself."""

import random

import pytest

from tools.fuzz.findings import signature, write_finding
from tools.fuzz.records import Record, join, split
from tools.fuzz.target import FindingError, trimmed
from tools.fuzz.targets import TARGETS
from tools.fuzz.work import Task, work

UNITS = {
    "companion-mavlink": 2000,
    "shim-mavlink": 9600,
    "yaml": 1500,
    "trajectory": 600,
    "logs": 200,
}


@pytest.mark.parametrize("name", sorted(UNITS))
def test_a_short_run_has_no_finding(name, tmp_path):
    done = work(Task(name, 20_26, UNITS[name], tmp_path), TARGETS[name]())

    assert done.findings == {}, "each says how it is repeated"
    assert done.units >= UNITS[name]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["companion-mavlink", "shim-mavlink"])
def test_any_bytes_are_an_input(name):
    target = TARGETS[name]()
    rng = random.Random(3)
    for size in (0, 1, 3, 4, 5, 300, 2000):
        data = rng.randbytes(size)
        assert target.run(data) >= 1
        assert target.run(target.mutate(data, rng)) >= 1


def test_records_come_back_as_they_were():
    records = [Record(1, 2, b"abc"), Record(255, 0, b""), Record(3, 200, bytes(300))]
    assert split(join(b"head", records)) == (b"head", records)
    assert split(join(b"head", records)[:-250])[1][:2] == records[:2]


class Fragile:
    """A target that breaks on two bytes."""

    unit = "packets"

    def generate(self, rng):
        return bytes(rng.choice(b"abxy") for _ in range(40))

    def mutate(self, data, rng):
        return data

    def run(self, data):
        if b"x" in data and b"y" in data:
            raise FindingError(f"x and y, {len(data)} bytes")
        return len(data)

    def pieces(self, data):
        return [data[i : i + 1] for i in range(len(data))]

    def join(self, pieces):
        return b"".join(pieces)


def test_a_finding_is_trimmed_written_once_and_says_how_it_is_repeated(tmp_path):
    done = work(Task("yaml", 1, 2000, tmp_path), Fragile())

    ((sign, path),) = done.findings.items()
    assert sign == "FindingError in test_short_runs.py:run x and y,  bytes"
    files = sorted(tmp_path.iterdir())
    assert [str(files[0]), files[1].suffix] == [path, ".txt"]
    assert sorted(files[0].read_bytes()) == sorted(b"xy")
    text = files[1].read_text()
    assert f"python -m tools.fuzz yaml --repeat {path}" in text
    assert "x and y" in text


def test_the_same_seed_gives_the_same_inputs_and_another_gives_others(tmp_path):
    def inputs(seed):
        seen = []

        class Listening(Fragile):
            def run(self, data):
                seen.append(data)
                return 1

        work(Task("yaml", seed, 30, tmp_path), Listening())
        return seen

    assert inputs(1) == inputs(1)
    assert not set(inputs(1)) & set(inputs(2))


def test_what_fails_only_once_is_written_untrimmed(tmp_path):
    class Once(Fragile):
        def run(self, data):
            raise FindingError("always") if data == b"ab" else ValueError("else")

    error = FindingError("something else")
    path = write_finding(tmp_path, "yaml", Once(), b"abcd", error)
    assert path.read_bytes() == b"abcd"


def test_trimming_ends_where_nothing_more_can_be_left_out():
    target = Fragile()
    runs = []

    def fails(data):
        runs.append(data)
        return b"x" in data and b"y" in data

    small = trimmed(target, b"a" * 50 + b"x" + b"b" * 50 + b"y", fails)
    assert small == b"xy"
    assert len(runs) < 400
    assert signature(FindingError("1 of 2")) == "FindingError in"
