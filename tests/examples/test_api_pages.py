"""The library's pages show the examples as they are, and every public name."""

import json
import re
from pathlib import Path

import pytest

from companion import api
from tools import api_reference

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "api"
SOURCES = {
    "own-controller.md": "own_controller.py",
    "own-trajectory.md": "own_trajectory.py",
    "own-wind.md": "own_wind.py",
    "another-vehicle.md": "another_vehicle.py",
    "notebook.md": "fly_and_plot.ipynb",
}


def blocks(page: str, language: str) -> list[str]:
    text = (PAGES / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def code_of(example: str) -> str:
    text = (ROOT / "examples" / example).read_text(encoding="utf-8")
    if not example.endswith(".ipynb"):
        return text
    cells = ["".join(cell["source"]) for cell in json.loads(text)["cells"]]
    return "\n".join(f"{cell}\n" for cell in cells)


def test_there_is_a_page_for_each_example():
    assert {path.name for path in PAGES.glob("*.md")} == {*SOURCES, "index.md", "reference.md"}
    assert {*SOURCES.values()} == {
        path.name for path in (ROOT / "examples").iterdir() if path.suffix in (".py", ".ipynb")
    }


@pytest.mark.parametrize("page", SOURCES)
def test_the_code_that_a_page_shows_is_the_examples(page):
    example = SOURCES[page]
    shown = blocks(page, "python")
    assert shown
    for block in shown:
        assert block in code_of(example)
    assert f"(../../examples/{example})" in (PAGES / page).read_text(encoding="utf-8")


def test_what_the_overview_shows_is_what_it_prints(capsys):
    (code,), (output,) = blocks("index.md", "python"), blocks("index.md", "text")
    exec(compile(code, "index.md", "exec"), {})
    printed = capsys.readouterr().out
    number = re.compile(r"\d+(?:\.\d+)?")
    assert number.sub("#", printed) == number.sub("#", output)
    said, shown = ([float(n) for n in number.findall(text)] for text in (printed, output))
    assert said == pytest.approx(shown, rel=0.1)


def test_every_public_name_is_in_the_reference_once():
    named = [name for names in api_reference.GROUPS.values() for name in names]
    assert sorted(named) == sorted(api.__all__)
    assert all(hasattr(api, name) for name in named)


def test_the_reference_is_made_of_the_code_as_it_is():
    assert api_reference.PAGE.read_text(encoding="utf-8") == api_reference.page(), (
        "run python -m tools.api_reference"
    )


def test_everything_public_says_what_it_is():
    empty = [line for line in api_reference.page().splitlines() if line.endswith("|  |")]
    assert empty == []
