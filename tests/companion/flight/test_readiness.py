"""How a person is told what is waited for."""

from companion.flight.stages.readiness import Progress

GPS, HOME = ("a position",), ("a position", "home")


def test_what_is_settled_within_a_second_is_not_told():
    progress = Progress(10.0)
    assert progress.news(GPS, 10.5) is None
    assert progress.news((), 11.5) is None


def test_what_lasts_is_told_once():
    progress = Progress(10.0)
    assert progress.news(GPS, 11.0) == "waiting for: a position"
    assert progress.news(GPS, 30.0) is None


def test_a_change_is_told_but_not_every_flicker():
    progress = Progress(10.0)
    progress.news(GPS, 11.0)
    assert progress.news(HOME, 11.2) is None
    assert progress.news(GPS, 11.4) is None
    assert progress.news(HOME, 14.0) == "waiting for: a position, home"
