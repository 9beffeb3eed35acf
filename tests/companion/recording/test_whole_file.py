import os
from pathlib import Path

import pytest

from companion.recording.whole_file import write_whole


def test_a_file_is_on_the_disk_before_it_takes_the_old_ones_place(tmp_path, monkeypatch):
    done = []
    fsync, replace = os.fsync, Path.replace
    monkeypatch.setattr(os, "fsync", lambda file: (done.append("fsync"), fsync(file)))
    monkeypatch.setattr(Path, "replace", lambda *paths: (done.append("replace"), replace(*paths)))

    write_whole(tmp_path / "a.txt", "new")

    assert done == ["fsync", "replace"]
    assert (tmp_path / "a.txt").read_text() == "new"


def test_what_can_not_be_written_leaves_the_old_file(tmp_path, monkeypatch):
    def full(_):
        raise OSError("no space")

    (tmp_path / "a.txt").write_text("old")
    monkeypatch.setattr(os, "fsync", full)

    with pytest.raises(OSError, match="no space"):
        write_whole(tmp_path / "a.txt", "new")

    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"
