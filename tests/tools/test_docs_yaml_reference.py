"""The YAML reference is what the models say."""

from companion.config.describe import describe, every_key
from tools.docs.yaml_reference import PAGE, page
from tools.schemas import MODELS


def test_the_page_is_what_the_models_say():
    told = "Run: python -m tools.docs.yaml_reference"
    assert PAGE.read_text(encoding="utf-8") == page(), told


def test_every_key_of_every_file_has_its_row():
    rows = [line for line in page().splitlines() if line.startswith(("| `", "| [`"))]
    keys = [key for model in MODELS.values() for key in every_key(describe(model))]
    assert len(rows) == len(keys) > 200
    assert all(f"`{key.name}`" in row for key, row in zip(sorted_names(keys), rows, strict=True))


def sorted_names(keys):
    """Keys as the page has them: those of a section together, then the sections below it."""
    found = []
    for model in MODELS.values():
        waiting = [describe(model)]
        while waiting:
            section = waiting.pop(0)
            found += section.keys
            waiting = [inner for key in section.keys for inner in key.sections] + waiting
    assert len(found) == len(keys)
    return found


def test_no_cell_breaks_its_table():
    tables = [line for line in page().splitlines() if line.startswith("|")]
    assert {line.replace("\\|", "").count("|") for line in tables} == {5}
