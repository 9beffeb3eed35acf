"""The documentation's site in a browser: it is read, and searched, as it lies on the disk."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.browser.chromium import WITHOUT_GL, driver, launched

ROOT = Path(__file__).parents[2]


@pytest.fixture
def page(tmp_path_factory):
    with (
        driver() as playwright,
        launched(playwright, tmp_path_factory.mktemp("browser"), *WITHOUT_GL) as browser,
    ):
        yield browser.new_page(viewport={"width": 400, "height": 800})


def test_a_site_that_is_opened_from_the_disk_is_whole_and_can_be_searched(page, tmp_path):
    subprocess.run(
        (sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(tmp_path)),
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        check=True,
        capture_output=True,
    )
    errors, asked = [], []
    page.on("console", lambda said: errors.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "how-it-works.html").as_uri())

    broken = "Array.from(document.images).filter((i) => !i.naturalWidth).map((i) => i.src)"
    assert page.evaluate("document.images.length") >= 6
    assert page.evaluate(broken) == []
    assert page.evaluate("document.documentElement.scrollWidth") == 400

    page.keyboard.press("s")
    page.wait_for_function("document.activeElement.dataset.mdComponent === 'search-query'")
    page.keyboard.type("geofence")
    page.wait_for_selector(".md-search-result__item a[href*='yaml.html']", state="attached")
    assert errors == []
    assert [url for url in asked if url.startswith(("http:", "https:"))] == []
