"""What the live page has of others is what was fetched, beside its licences."""

import shutil

from tools.vendor_web import VENDOR, differences


def test_the_files_are_those_of_the_manifest():
    assert differences() == []
    assert all((VENDOR / name / "LICENSE").is_file() for name in ("uplot", "three"))


def test_a_file_that_was_changed_or_added_is_seen(tmp_path):
    vendor = tmp_path / "vendor"
    shutil.copytree(VENDOR, vendor)
    with (vendor / "uplot" / "uPlot.iife.min.js").open("a") as file:
        file.write("\n")
    (vendor / "three" / "more.js").write_text("")
    found = differences(vendor)
    assert len(found) == 2
    assert any("uPlot.iife.min.js" in text for text in found)
    assert any("more.js" in text for text in found)
