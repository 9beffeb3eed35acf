import io

from companion.experiments.progress import ProgressDisplay


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_what_is_no_terminal_gets_a_line_now_and_then_and_the_last():
    shown, clock = io.StringIO(), Clock()
    with ProgressDisplay("flying", stream=shown, now_s=clock) as display:
        for done in range(101):
            clock.now = 1.0 * done
            display(done, 100, None if done == 0 else 100.0 - done)

    assert shown.getvalue().splitlines() == [
        "flying: 0 of 100 flights",
        "flying: 30 of 100 flights, 1 min 10 s left",
        "flying: 60 of 100 flights, 40 s left",
        "flying: 90 of 100 flights, 10 s left",
        "flying: 100 of 100 flights",
    ]


def test_a_note_stands_beside_the_figures_and_nothing_is_taken_for_markup():
    shown = io.StringIO()
    with ProgressDisplay("tuning", "evaluations", shown) as display:
        display.note("best [31] mm")
        display(1, 1, 0.0)
        display.say("[done]")

    assert shown.getvalue().splitlines() == [
        "tuning: 1 of 1 evaluations, best [31] mm",
        "[done]",
    ]


def test_a_terminal_has_a_bar_with_the_remaining_time(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    shown = Terminal()
    with ProgressDisplay("flying", stream=shown) as display:
        display(3, 10, 61.0)

    assert "3/10" in shown.getvalue()
    assert "1 min 01 s left" in shown.getvalue()


def test_a_dumb_terminal_gets_lines(monkeypatch):
    monkeypatch.setenv("TERM", "dumb")
    shown = Terminal()
    with ProgressDisplay("flying", stream=shown) as display:
        display(1, 1, 0.0)
    assert shown.getvalue() == "flying: 1 of 1 flights\n"
