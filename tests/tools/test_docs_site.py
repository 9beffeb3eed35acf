"""The documentation's site: built strictly, whole without a network, searchable."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOADED = re.compile(
    r"<(?:script|img|iframe|source)\b[^>]*\bsrc=[\"']?([^\"' >]+)"
    r"|<link\b(?![^>]*rel=[\"']?(?:canonical|prev|next))[^>]*\bhref=[\"']?([^\"' >]+)"
)
LOADED_BY_STYLE = re.compile(r"@import\s+[\"']?([^\"';]+)|url\([\"']?(?!data:)([^)\"']+)")
ELSEWHERE = re.compile(r"(?:[a-z]+:)?//", re.IGNORECASE)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        (sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)),
        cwd=ROOT,
        env=os.environ | {"NO_COLOR": "1", "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


def test_no_page_loads_anything_from_elsewhere(site):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 60
    for page in pages:
        loaded = ["".join(found) for found in LOADED.findall(page.read_text(encoding="utf-8"))]
        assert loaded, page
        assert [target for target in loaded if ELSEWHERE.match(target)] == [], page
    for sheet in site.rglob("*.css"):
        found = ["".join(f) for f in LOADED_BY_STYLE.findall(sheet.read_text(encoding="utf-8"))]
        assert [target for target in found if ELSEWHERE.match(target)] == [], sheet


def test_the_search_finds_pages_and_not_the_code_that_they_link_to(site):
    index = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))
    places = {entry["location"].partition("#")[0] for entry in index["docs"]}
    assert {"first-flight.html", "safety.html", "contributing.html", "yaml.html"} <= places
    assert not [place for place in places if place.startswith("source/")]


def test_code_that_a_document_links_to_has_a_page_with_its_text(site):
    link = re.search(
        r'href="([^"]+mpc\.py\.html)"', (site / "paper.html").read_text(encoding="utf-8")
    )
    page = (site / link[1]).resolve()
    assert page == (site / "source" / "companion" / "control" / "mpc.py.html").resolve()
    assert "ConstrainedAxis" in page.read_text(encoding="utf-8")
