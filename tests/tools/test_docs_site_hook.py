"""Where the site leads a document's links, and what it makes of its text."""

import pytest

hook = pytest.importorskip("tools.docs.site_hook")


@pytest.mark.parametrize(
    ("target", "uri", "led"),
    [
        ("glossary.md#symbols", "paper.md", "glossary.md#symbols"),
        ("../companion/control/mpc.py", "paper.md", "source/companion/control/mpc.py.md"),
        ("../configs/missions/", "yaml.md", "source/configs/missions/index.md"),
        ("decisions/", "index.md", "decisions/README.md"),
        ("../CONTRIBUTING.md#where-things-go", "index.md", "contributing.md#where-things-go"),
        ("../../CHANGELOG.md", "decisions/README.md", "../changelog.md"),
        ("../performance.md", "decisions/0019-compiled-plant.md", "../performance.md"),
        (
            "../../companion/frames.py",
            "decisions/0013.md",
            "../source/companion/frames.py.md",
        ),
        ("https://pypi.org/project/motioncapture/", "mocap.md", None),
        ("#signing", "links.md", None),
    ],
)
def test_links_lead_to_where_the_site_has_what_they_mean(target, uri, led):
    assert hook._led(target, uri) == (target if led is None else led)


def test_what_stands_in_code_is_left_as_it_is():
    text = "```\n[a](../x.py)\ntext:\n- b\n```\nand `[a](../x.py)` and ``x ` y``\n"
    assert hook._prose(text, lambda prose: hook._spaced(prose).replace("a", "z")) == text.replace(
        "and", "znd"
    )


def test_a_list_right_below_a_line_of_text_becomes_a_list():
    assert hook._spaced("What:\n- one\n- two\n  more\n- three") == (
        "What:\n\n- one\n- two\n  more\n- three"
    )
    assert hook._spaced("a table\n| - | b |") == "a table\n| - | b |"


def test_documents_at_the_root_link_as_pages_of_the_site():
    text = "[a](docs/links.md) [b](companion/frames.py) [c](https://x.org) `[d](docs/e.md)`"
    assert hook._at_home(text) == (
        "[a](links.md) [b](../companion/frames.py) [c](https://x.org) `[d](docs/e.md)`"
    )


def test_a_folder_in_the_navigation_stands_for_its_pages_the_index_first(tmp_path):
    for name in ("0002-b.md", "README.md", "0001-a.md", "picture.png"):
        (tmp_path / "decisions").mkdir(exist_ok=True)
        (tmp_path / "decisions" / name).touch()
    nav = {"Project": ["architecture.md", {"Decisions": "decisions/"}]}
    pages = ["decisions/README.md", "decisions/0001-a.md", "decisions/0002-b.md"]
    assert hook._filled(nav, tmp_path) == {"Project": ["architecture.md", {"Decisions": pages}]}
