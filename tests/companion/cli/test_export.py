import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.flight.records import CHANNELS
from companion.recording.flight_log import FlightLog


@pytest.fixture
def folder(tmp_path):
    """A log with something in it."""
    log = FlightLog(tmp_path / "flight", CHANNELS)
    for k in range(5):
        log.record("event", 0.1 * k, {"severity": "info", "text": f"phase {k}, σ"})
    log.close()
    return tmp_path / "flight"


def companion(*words):
    return CliRunner().invoke(app, ["export", *map(str, words)])


def test_a_flight_is_exported_and_told_in_one_line(folder):
    done = companion(folder, "--to", "csv")
    assert done.exit_code == 0
    assert done.stdout.startswith(f"written: {folder / 'csv'}: 1 table, 5 rows, ")
    text = (folder / "csv" / "event.csv").read_text(encoding="utf-8")
    assert text.splitlines()[1] == '0.0,info,"phase 0, σ"'


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--to", "xlsx"), "there are parquet, csv, foxglove, rerun"),
        (("--to", "ulog"), "no maintained library writes a new ULog"),
        (("--to", "csv", "--out", "{folder}"), "is there already and is not written over"),
    ],
)
def test_what_cannot_be_done_is_told_in_one_line_and_ends_with_2(folder, words, said):
    done = companion(folder, *(word.format(folder=folder) for word in words))
    assert done.exit_code == 2
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert said in done.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["flight.mcap", "flight.tlog"]


def test_a_folder_without_a_flight_is_refused(tmp_path):
    done = companion(tmp_path)
    assert done.exit_code == 2
    assert "holds no flight.mcap" in done.stderr
