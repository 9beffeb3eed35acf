import asyncio
import io

from rich.console import Console

from companion.flight.clock import run_in_virtual_time
from companion.flight.observer import TickView
from companion.report.terminal import TerminalObserver

TICK = TickView("track", 0.5, 0.0194, 8.5, 0.51, "")


class Shown(io.StringIO):
    encoding = "utf-8"


def make(*, terminal, verbose=False, **console):
    shown = Shown()
    kind = Console(file=shown, force_terminal=terminal, width=80, highlight=False, **console)
    return TerminalObserver(kind, verbose=verbose), shown


def ticks(observer, count, view=TICK):
    for _ in range(count):
        observer.tick(view)


def test_phases_have_the_flights_time_since_the_first():
    observer, shown = make(terminal=False)

    async def flight():
        await asyncio.sleep(5.0)
        observer.phase("connect", "udpin://127.0.0.1:14540")
        await asyncio.sleep(12.5)
        observer.phase("arm", "")

    with observer:
        run_in_virtual_time(flight())

    assert shown.getvalue().splitlines() == [
        "   0.0 s  connect     udpin://127.0.0.1:14540",
        "  12.5 s  arm",
    ]


def test_warnings_and_errors_are_always_shown_and_information_only_when_asked_for():
    for verbose in (False, True):
        observer, shown = make(terminal=False, verbose=verbose)
        for severity in ("info", "warning", "error"):
            observer.message(severity, "something happened")
        assert ("info: something" in shown.getvalue()) == verbose
        assert "warning: something" in shown.getvalue()
        assert "error: something" in shown.getvalue()


def test_what_goes_to_a_file_is_not_wrapped_and_has_no_escapes_and_no_live_line():
    observer, shown = make(terminal=False)
    with observer:
        observer.message("warning", "word " * 60)
        ticks(observer, 200)

    assert len(shown.getvalue().splitlines()) == 1
    assert "\x1b" not in shown.getvalue()
    assert "\r" not in shown.getvalue()


def test_a_terminal_has_a_live_line_that_is_written_over_and_gone_at_the_end():
    observer, shown = make(terminal=True)
    with observer:
        ticks(observer, 100)

    frames = shown.getvalue().split("\r\x1b[2K")
    assert frames[1] == " " * 10 + "██████······  50%  track    error   19.4 mm  tilt  8.5°"
    assert len(frames) == 2 + 100 // 20
    assert frames[-1] == ""


def test_the_live_line_has_the_flights_time():
    observer, shown = make(terminal=True)

    async def flight():
        observer.phase("connect", "")
        await asyncio.sleep(23.4)
        ticks(observer, 20)

    run_in_virtual_time(flight())

    assert "\r\x1b[2K  23.4 s  ██████······  50%  track" in shown.getvalue()


def test_a_message_stands_above_the_live_line():
    observer, shown = make(terminal=True)
    with observer:
        ticks(observer, 20)
        observer.message("warning", "look")
        after = shown.getvalue().split("look", 1)[1]

    assert "\n" in after
    assert after.rstrip().endswith("tilt  8.5°")


def test_the_live_line_never_breaks_on_a_narrow_terminal_and_names_the_fallback():
    wide, shown = make(terminal=True, color_system="standard", no_color=False)
    ticks(wide, 20, TickView("track", 1.0, 0.5, 25.0, 0.5, "clipped closed form"))
    line = shown.getvalue().removeprefix("\r\x1b[2K\x1b[33m").removesuffix("\x1b[0m")
    assert line.endswith("clipped closed form")
    assert len(line) < 80

    shown = Shown()
    narrow = TerminalObserver(Console(file=shown, force_terminal=True, width=40), verbose=False)
    ticks(narrow, 20)
    assert len(shown.getvalue().replace("\r\x1b[2K", "")) == 39


def test_no_color_leaves_no_colour(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    observer, shown = make(terminal=True)
    observer.message("error", "bad")
    ticks(observer, 20, TickView("track", 1.0, 0.01, 5.0, 0.5, "level"))

    assert "\x1b[3" not in shown.getvalue()
    assert "level" in shown.getvalue()


def test_a_terminal_that_knows_no_block_characters_gets_plain_ones():
    shown = Shown()
    shown.encoding = "ascii"
    observer = TerminalObserver(Console(file=shown, force_terminal=True, width=80), verbose=False)
    ticks(observer, 20)

    assert "######......  50%" in shown.getvalue()


def test_a_terminal_that_is_gone_at_the_end_harms_nobody():
    observer, shown = make(terminal=True)
    with observer:
        ticks(observer, 20)
        shown.close()


def test_on_a_narrow_terminal_the_live_line_keeps_its_figures():
    shown = Shown()
    console = Console(file=shown, force_terminal=True, width=61, highlight=False)
    observer = TerminalObserver(console, verbose=False)
    with observer:
        ticks(observer, 20)
    line = shown.getvalue().split("\x1b[2K")[1].rstrip("\r")
    assert line.endswith("error   19.4 mm  tilt  8.5°")
    assert len(line) < 61
