"""The list of what was set: on the disk before, and read again by another process."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.check.restore_file import (
    RestoreFileError,
    RestoreList,
    read_restore_file,
    write_restore_file,
)
from companion.preflight.finding import ParameterChange

finite = st.floats(allow_nan=False, allow_infinity=False)
names = st.text("ABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789", min_size=1, max_size=16)
changes = st.builds(ParameterChange, names, finite, finite, st.text(max_size=40))
lists = st.builds(
    RestoreList,
    st.sampled_from(["px4", "ardupilot"]),
    st.integers(1, 255),
    st.lists(changes, max_size=5).map(tuple),
)


@given(lists)
@settings(deadline=None, derandomize=True)
def test_what_is_written_is_read(tmp_path_factory, wanted):
    path = tmp_path_factory.mktemp("restore") / "restore.json"
    write_restore_file(path, wanted)
    assert read_restore_file(path) == wanted


def test_it_says_what_it_is_for(tmp_path):
    path = tmp_path / "restore.json"
    write_restore_file(path, RestoreList("px4", 1, (ParameterChange("A", 1.0, 2.0, "so"),)))
    assert "companion check --connect URL --restore" in path.read_text()


def test_one_that_is_there_is_not_written_over_unless_it_is_ones_own(tmp_path):
    path = tmp_path / "restore.json"
    wanted = RestoreList("px4", 1, ())
    write_restore_file(path, wanted)
    with pytest.raises(RestoreFileError, match="is there already"):
        write_restore_file(path, wanted)
    write_restore_file(path, wanted, replace=True)


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(RestoreFileError, match="no parameter is set"):
        write_restore_file(tmp_path / "none" / "restore.json", RestoreList("px4", 1, ()))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"autopilot": "px4", "system_id": "x", "parameters": []}',
        '{"autopilot": "px4", "system_id": 1, "parameters": {}}',
        '{"autopilot": "px4", "system_id": 1, "parameters": [{"name": "A"}]}',
        '{"autopilot": "px4", "system_id": 1, "parameters": [{"name": "A", "old": "nan"}]}',
        '{"autopilot": "px4", "system_id": 1, "parameters": [{"name": "A", "old": 1, "new": NaN}]}',
        '{"autopilot": "px4", "system_id": 1, "parameters": [7]}',
    ],
)
def test_what_is_no_list_is_said_to_be_none(tmp_path, text):
    path = tmp_path / "restore.json"
    path.write_text(text)
    with pytest.raises(RestoreFileError, match="is no list of parameters"):
        read_restore_file(path)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(RestoreFileError, match="cannot be read"):
        read_restore_file(tmp_path / "restore.json")
