"""The page on performance is what the kept results make of it."""

import json
import re

import pytest

from tools.performance_page.figures import digest_line, drawn_from, write_figures
from tools.performance_page.markdown import figure, table
from tools.performance_page.page import SECTIONS, page
from tools.performance_page.results import (
    IMAGES,
    PAGE,
    RESULTS,
    ROOT,
    Result,
    read_results,
)


def test_the_page_in_the_repository_is_what_the_results_make():
    assert PAGE.read_text(encoding="utf-8") == page(read_results(RESULTS))


def test_its_pictures_were_drawn_from_the_results_in_the_repository():
    results = read_results(RESULTS)
    for name, benchmark in drawn_from().items():
        if benchmark in results:
            drawn = (IMAGES / name).read_text(encoding="utf-8")
            assert digest_line(results[benchmark]) in drawn, name


def test_every_picture_that_the_page_shows_is_there():
    shown = set(re.findall(r"\(images/(performance-\S+)\)", PAGE.read_text(encoding="utf-8")))
    assert shown == {name for name in drawn_from() if (IMAGES / name).exists()}


def test_each_section_names_a_benchmark_that_there_is():
    for section in SECTIONS:
        assert (ROOT / "benchmarks" / f"{section.name}.py").exists()


def test_what_was_not_measured_is_said_with_the_command_that_does():
    text = page({})
    for section in SECTIONS:
        assert f"Not measured yet: `python benchmarks/{section.name}.py --keep`" in text


def test_machine_commit_command_and_noise_stand_over_the_figures():
    kept = json.loads((RESULTS / "tick.json").read_text(encoding="utf-8"))
    text = page(read_results(RESULTS))
    assert kept["command"] in text
    assert f"commit {kept['commit']}" in text
    assert kept["machine"]["processor"] in text
    assert f"{kept['results']['work_noise']['p99']:.2f} times its median" in text


def test_pictures_are_the_same_each_time(tmp_path):
    results = {"tick": read_results(RESULTS)["tick"]}
    first = [file.read_bytes() for file in write_figures(results, tmp_path)]
    assert first == [file.read_bytes() for file in write_figures(results, tmp_path)]


def test_the_latency_of_each_client_stands_beside_the_timers(tmp_path):
    spread = {"p50": 0.2, "p99": 0.9, "max": 4.0}
    client = {
        "setpoints": 6000,
        "latency_ms": spread,
        "timer_noise_ms": {"p50": 0.1, "p99": 0.4, "max": 3.0},
        "p99_above_noise_ms": 0.5,
        "by_segment_ms": [spread, spread],
        "late": 0,
        "unanswered": 1,
        "processor_share": 0.1,
        "memory_mib": [{"settled": 118.0, "end": 119.0, "peak": 160.0}],
        "own_records": [{"missed_deadlines": 2}],
    }
    machine = read_results(RESULTS)["tick"].machine
    figures = {"clients": {"companion": client}, "left_out": ["mavsdk"]}
    result = Result("latency", "2026-01-01", "abc", "python it", machine, figures)
    text = page({"latency": result})
    row = (
        "| companion | 6000 | 0.200 | 0.900 | 4.00 | 0.400 | 0.500 | 0 | 1 | 2 | 10 % | 118, 119 |"
    )
    assert row in text
    assert "was woken late, at the 99th percentile, by 0.400 ms (companion)" in text
    assert [file.name for file in write_figures({"latency": result}, tmp_path)] == [
        "performance-latency.svg"
    ]


def test_a_file_that_is_no_result_is_refused(tmp_path):
    (tmp_path / "tick.json").write_text('{"benchmark": "tick"}')
    with pytest.raises(ValueError, match="no benchmark's result"):
        read_results(tmp_path)


@pytest.mark.parametrize(
    ("value", "told"),
    [(0.0, "0"), (15.57, "15.6"), (1234.5, "1 234"), (0.0512, "0.0512"), (2.3e-11, "2·10^-11")],
)
def test_figures_have_three_digits(value, told):
    assert figure(value) == told


def test_a_cell_cannot_break_its_table():
    assert table(["a|b"], [["c|d"]]) == ["| a/b |", "|---|", "| c/d |", ""]
