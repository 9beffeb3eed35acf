"""The table of faults in docs/safety.md says what the table of faults says."""

import json

import pytest

from companion.experiments.faults.table import load_table
from tools import safety_table
from tools.safety_table import BEGIN, DOCS, END, differences, split, table

ROWS = load_table().rows
MEASURED = {
    row.name: [
        {"autopilot": a, "measured": {"detected_after_s": 0.123, "ending": "held"}}
        for a in row.autopilots
    ]
    for row in ROWS
}


def docs(rows=ROWS, measured=MEASURED):
    return f"# Safety\n\n{BEGIN}\nMeasured so.\n\n{table(rows, measured)}\n{END}\n\nMore.\n"


def test_the_docs_have_the_rows_of_the_table():
    assert differences(ROWS, DOCS.read_text(encoding="utf-8")) == []


def test_what_was_measured_may_be_anything():
    assert differences(ROWS, docs()) == []
    assert differences(ROWS, docs(measured={})) == []
    assert "0.12 s" in docs()


def test_what_both_autopilots_have_in_common_is_told_once():
    line = next(line for line in docs().splitlines() if line.startswith("| `reboot`"))
    assert " | 0.12 s | " in line
    assert " | held | " in line
    MEASURED_ONE = {"reboot": [MEASURED["reboot"][0]]}
    line = next(
        line for line in docs(measured=MEASURED_ONE).splitlines() if line.startswith("| `reboot`")
    )
    assert " | PX4 0.12 s | " in line


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda rows: rows[1:], "is missing, or its first cell is another"),
        (lambda rows: rows[::-1], "the rows stand in another order"),
        (
            lambda rows: (rows[0].model_copy(update={"done": "nothing"}), *rows[1:]),
            "says something else",
        ),
        (
            lambda rows: (rows[0].model_copy(update={"what": "Else."}), *rows[1:]),
            "the table has no row like `loss`: Else.",
        ),
        (
            lambda rows: (*rows[:-1], rows[-1].model_copy(update={"after": "never"})),
            f"{ROWS[-1].name} says something else",
        ),
    ],
)
def test_a_row_that_differs_is_told(change, says):
    assert any(says in told for told in differences(ROWS, docs(change(ROWS))))


def written(folder, passed):
    flights = {
        row.name: [
            {"autopilot": a, "passed": passed, "measured": {"ending": "held"}}
            for a in row.autopilots
        ]
        for row in ROWS
        if row.kind == "flight"
    }
    flights["reboot"][0]["passed"] = True
    rows = [{"name": name, "flights": found} for name, found in flights.items()]
    made = {"command": "companion faults", "commit": "abc"}
    path = folder / "faults.json"
    path.write_text(json.dumps({"made": made, "rows": rows}), encoding="utf-8")
    return path


def write(path, monkeypatch):
    """Docs of a folder, written with the tool."""
    place = path.with_name("safety.md")
    place.write_text(docs(), encoding="utf-8")
    monkeypatch.setattr(safety_table, "DOCS", place)
    monkeypatch.setattr("sys.argv", ["safety_table.py", str(path)])
    return place, safety_table.main


def test_flights_that_passed_are_written(tmp_path, monkeypatch):
    place, main = write(written(tmp_path, passed=True), monkeypatch)
    assert main() == 0
    text = place.read_text(encoding="utf-8")
    assert "(commit abc)" in text
    assert differences(ROWS, text) == []


def test_flights_that_failed_are_not_written(tmp_path, monkeypatch, capsys):
    place, main = write(written(tmp_path, passed=False), monkeypatch)
    with pytest.raises(SystemExit) as refused:
        main()
    assert refused.value.code == 2
    told = capsys.readouterr().err
    assert "has flights that failed: loss (px4), loss (ardupilot), " in told
    assert "reboot (px4)" not in told
    assert "reboot (ardupilot)" in told
    assert place.read_text(encoding="utf-8") == docs()


def test_docs_without_a_place_for_the_table_are_refused():
    with pytest.raises(SystemExit, match="has no lines"):
        split("# Safety\n")
