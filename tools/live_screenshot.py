"""Pictures of the live page for the documents: a recorded flight through a fan's jet.

    python -m tools.live_screenshot [--out docs/images]

Needs Chromium, and the extras `live` and `dev` (Playwright).  The scene is drawn in software.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

_ARGUMENTS = (
    "--no-sandbox",
    "--disable-background-networking",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
_AT_S = 34.2
"""In the jet, for the second time."""
_PICTURES = (
    ("live-page.png", 1440, 900, "light", 1.0),
    ("live-phone.png", 400, 850, "dark", 1.5),
)


def main() -> None:
    """Fly, show, take the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/images"))
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "flight"
        companion = [sys.executable, "-m", "companion"]
        fly = ["fly", "--traj=4", "--wind=fan", "--lockstep", "--seed=1", f"--out={folder}"]
        subprocess.run([*companion, *fly], check=True, capture_output=True)
        with subprocess.Popen(
            [*companion, "live", str(folder)], stderr=subprocess.PIPE, text=True
        ) as page:
            try:
                _take(_url(page), out)
            finally:
                page.terminate()


def _url(page: "subprocess.Popen[str]") -> str:
    assert page.stderr is not None
    for line in page.stderr:
        found = re.match(r"page: (\S+)", line)
        if found:
            return found[1]
    raise SystemExit("companion live did not start")


def _take(url: str, out: Path) -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=list(_ARGUMENTS)
        )
        for name, width, height, scheme, scale in _PICTURES:
            _picture(browser, url, out / name, (width, height), scheme, scale)
        browser.close()


def _picture(
    browser: Browser, url: str, path: Path, size: tuple[int, int], scheme: str, scale: float
) -> None:
    page = browser.new_page(
        viewport={"width": size[0], "height": size[1]},
        color_scheme="dark" if scheme == "dark" else "light",
        device_scale_factor=scale,
    )
    page.goto(url)
    page.wait_for_selector("#player:not([hidden])")
    page.locator("#slider").evaluate(
        "(slider, at) => { slider.value = at; slider.dispatchEvent(new Event('input')); }", _AT_S
    )
    page.wait_for_timeout(1500)  # the scene's fonts and its first picture
    page.screenshot(path=path)
    page.close()
    print(path)


if __name__ == "__main__":
    main()
