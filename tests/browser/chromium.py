"""Debian's Chromium, driven by Playwright; nothing is fetched."""

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

CHROMIUM = shutil.which("chromium")
QUIETLY = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
SOFTWARE_GL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
WITHOUT_GL = ("--disable-gpu", "--disable-3d-apis")


def require_chromium() -> None:
    """Skip where there is no browser; in CI only where .ci/run has said that it could get none."""
    if CHROMIUM is None:
        may_skip = not os.environ.get("CI") or os.environ.get("WITHOUT_CHROMIUM")
        assert may_skip, "the tests of pages need Chromium (see .ci/run)"
        pytest.skip("needs Chromium")


@contextlib.contextmanager
def driver() -> Iterator[Playwright]:
    """What drives browsers; there can be one at a time."""
    require_chromium()
    with sync_playwright() as playwright:
        yield playwright


@contextlib.contextmanager
def launched(playwright: Playwright, folder: Path, *arguments: str) -> Iterator[Browser]:
    """A browser that gives way to everything else: a flight in real time may be beside it."""
    niced = folder / "chromium"
    niced.write_text(f'#!/bin/sh\nexec nice -n 19 {CHROMIUM} "$@"\n')
    niced.chmod(0o755)
    browser = playwright.chromium.launch(executable_path=str(niced), args=[*QUIETLY, *arguments])
    try:
        yield browser
    finally:
        browser.close()


def until(page: Page, expression: str, timeout_s: float = 30.0) -> None:
    """Wait until something is so in the page.

    A function is not evaluated as a text, which the page's policy forbids.
    """
    page.wait_for_function(f"() => {expression}", timeout=timeout_s * 1e3)


class Trouble:
    """What a page complains of, and what it asks of others."""

    def __init__(self, page: Page) -> None:
        self.said: list[str] = []
        self.asked: list[str] = []
        page.on("console", self._on_console)
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", lambda request: self.asked.append(request.url))

    def _on_console(self, message) -> None:
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            self.said.append(message.text)

    def foreign(self, own: str) -> list[str]:
        """Requests to anybody but a server."""
        return [url for url in self.asked if not url.startswith((own, "data:", "blob:"))]
