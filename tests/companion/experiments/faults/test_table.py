"""The rows of the table: valid, each flyable, and their mistakes told."""

import re

import pytest

from companion.config.resolve import configs_folder
from companion.config.yaml_source import ConfigError
from companion.experiments.faults.flying import command, configured, orders
from companion.experiments.faults.table import chosen_rows, load_table
from companion.flight.assemble import infeasibilities, make_trajectory

TABLE = load_table()

ROW = """
rows:
  - name: a
    group: link
    what: x
    faults: {}
    promise: {endings: [landed]}
    detected: x
    done: x
    seen: x
"""


def read(text, folder):
    (folder / "t.yaml").write_text(text)
    return load_table(folder / "t.yaml")


def fault(text, folder):
    with pytest.raises(ConfigError) as caught:
        read(text, folder)
    return str(caught.value)


def all_orders(folder):
    return orders(TABLE, TABLE.rows, folder, seed=1)


def test_every_row_is_a_flight_that_its_vehicle_can_fly(tmp_path):
    found = all_orders(tmp_path)
    assert len(found) > 60
    for order in found:
        config = configured(order)
        assert config.mission.autopilot == order.autopilot
        trajectory = make_trajectory(config.mission)
        assert infeasibilities(trajectory, config.mission, config.vehicle) == [], order.title


def test_what_flies_a_row_again_is_a_command_line_that_means_the_same(tmp_path):
    import shlex

    import yaml
    from typer.testing import CliRunner

    from companion.cli import app

    order = next(o for o in all_orders(tmp_path) if o.row.name == "bad-link")
    words = shlex.split(command(order))
    assert words[:3] == ["companion", "fly", "--lockstep"]
    given = dict(zip(words[3::2], words[4::2], strict=True))
    assert given["--faults"] == "bad-link"
    assert given["--traj"] == "2"
    inline = next(o for o in all_orders(tmp_path) if o.row.name == "telemetry-gap")
    words = shlex.split(command(inline))
    text = words[words.index("--faults") + 1]
    assert yaml.safe_load(text) == inline.row.faults
    result = CliRunner().invoke(app, [*words[1:], "--set", "hover_s=-1"])
    assert result.exit_code == 2
    assert "hover_s is given twice" in result.output  # all else was understood


def test_paths_in_a_table_are_relative_to_it(tmp_path):
    text = f"mission: {{trajectory: own.csv}}{ROW}".replace("faults: {}", "faults: f.yaml")
    table = read(text, tmp_path)
    assert table.mission["trajectory"] == str(tmp_path / "own.csv")
    assert table.rows[0].faults == str(tmp_path / "f.yaml")


def test_a_row_promises_something_else_under_one_autopilot(tmp_path):
    differs = "    differs: {px4: {endings: [held], says: x}}\n    detected: x\n"
    row = read(ROW.replace("    detected: x\n", differs, 1), tmp_path).rows[0]
    assert row.promised("px4").endings == ("held",)
    assert row.promised("px4").says == "x"
    assert row.promised("ardupilot").endings == ("landed",)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ("endings: [landed]", "endings: [flown]", "input should be 'landed', 'held', 'handed ov"),
        ("endings: [landed]", "endings: []", "'rows.0.promise.endings'"),
        ("endings: [landed]", "endings: [landed], within_s: 1.0", "within_s needs the event"),
        (
            "endings: [landed]",
            "endings: [landed], handed_over_within_s: 1.0",
            "handed_over_within_s needs the event",
        ),
        ("    promise: {endings: [landed]}\n", "", "a row that is flown has a promise"),
        ("faults: {}", "kind: process", "one of a process has none"),
        ("    faults: {}\n", "", "a row that is flown has faults"),
        ("name: a", "name: A b", "'rows.0.name'"),
        ("    seen: x\n", "", "key 'rows.0.seen' is missing"),
        (
            "seen: x",
            "seen: x\n    differs: {px4: {endings: [flown]}}",
            "differs.px4.endings.0: Input",
        ),
    ],
)
def test_a_mistake_is_told_with_its_key(tmp_path, before, after, says):
    told = fault(ROW.replace(before, after, 1), tmp_path)
    assert told.startswith(str(tmp_path / "t.yaml"))
    assert says in told


def test_a_row_stands_there_once(tmp_path):
    assert "the row 'a' stands there twice" in fault(ROW + ROW.split("rows:\n")[1], tmp_path)


def test_rows_are_chosen_by_name_or_by_a_part_of_it():
    def names(*wanted):
        return [row.name for row in chosen_rows(TABLE, wanted)]

    assert names() == [row.name for row in TABLE.rows]
    assert names("delay") == ["delay"]
    assert names("estimator-jump") == ["estimator-jump-small", "estimator-jump-large"]
    assert names("loss", "reboot") == ["loss", "reboot"]
    with pytest.raises(ConfigError, match=r"--only nope: there is no such row\. There are loss, "):
        names("nope")


def test_the_shipped_faults_are_each_in_a_row():
    shipped = {path.stem for path in (configs_folder() / "faults").glob("*.yaml")}
    assert shipped <= {row.faults for row in TABLE.rows if isinstance(row.faults, str)}


def test_a_test_that_a_row_names_is_there():
    for row in TABLE.rows:
        assert (row.test is not None) or row.kind == "flight", row.name
        if row.test is not None:
            file, _, name = row.test.partition("::")
            text = (configs_folder().parent / file).read_text(encoding="utf-8")
            assert re.search(rf"def {re.escape(name.partition('[')[0])}\(", text), row.test
