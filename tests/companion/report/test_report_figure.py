import struct
from dataclasses import replace

import numpy as np
import pytest

from companion.report.figure import draw_flight
from companion.report.flight_data import FlightData
from tests.companion.report.synthetic_flight import NO_TRUTH, make_flight, make_ticks

SCORED_S = (5.0, 25.0)


def whole():
    data = make_flight(offset_m=(0.02, 0.0, 0.0), true_offset_m=(0.01, 0.0, 0.0))
    wind = np.exp(-((data.truth.time_s - 12.0) ** 2))
    return FlightData(data.ticks, replace(data.truth, wind_acceleration_m_s2=wind))


def in_trouble():
    """Fallbacks, failed solves, and samples of which little is known."""
    ticks = make_flight(offset_m=(0.02, 0.0, 0.0)).ticks
    silent = (ticks.time_s > 9.0) & (ticks.time_s < 9.5)
    desired = np.where(silent[:, None], np.nan, ticks.desired_enu_m)
    plan = np.where(silent, "shifted_plan", np.where(ticks.time_s > 15.0, "solved", ticks.plan))
    changes = {
        "plan": plan,
        "on_fallback": silent,
        "y_tilde_m_s": np.where(silent[:, None], np.nan, ticks.y_tilde_m_s),
        "computed_us": np.where(silent, np.nan, ticks.computed_us),
    }
    return FlightData(make_ticks(ticks.time_s, ticks.position_enu_m, desired, **changes), NO_TRUTH)


def never_tracked():
    data = make_flight(end_s=3.0)
    nowhere = np.full_like(data.ticks.desired_enu_m, np.nan)
    return FlightData(make_ticks(data.ticks.time_s, data.ticks.position_enu_m, nowhere), NO_TRUTH)


def nothing():
    return FlightData(make_ticks(np.empty(0), np.empty((0, 3)), np.empty((0, 3))), NO_TRUTH)


@pytest.mark.parametrize("make", [whole, in_trouble, never_tracked, nothing])
def test_whatever_was_recorded_can_be_drawn(tmp_path, make, recwarn):
    path = tmp_path / "track.png"

    draw_flight(make(), SCORED_S, "a title", path, tilt_limit_deg=25.0)

    content = path.read_bytes()
    assert content.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", content[16:24])
    assert (width, height) == (1485, 1045)
    assert [str(w.message) for w in recwarn] == []


@pytest.fixture
def drawn(monkeypatch):
    """What is drawn, by the beginning of its caption."""
    panels = {}

    def keep(figure, *_, **__):
        for axes in figure.axes:
            panels[axes.get_title(loc="left").split(",")[0]] = axes

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", keep)
    return panels


def test_the_phases_are_named_where_there_is_room_and_silence_is_none_of_them(tmp_path, drawn):
    data = whole()
    names = data.ticks.phase.astype("U12")  # wide enough for every name below
    names[1000:1100] = "silence"
    names[2900:] = "settle"
    data = FlightData(replace(data.ticks, phase=names), data.truth)

    draw_flight(data, SCORED_S, "", tmp_path / "x.png")

    said = [(text.get_text(), text.get_position()[0]) for text in drawn["commanded tilt"].texts]
    assert [name for name, _ in said] == ["hover", "track", "return"]
    assert [middle for _, middle in said] == pytest.approx([-2.5, 10.0, 22.0], abs=0.02)


def test_solved_and_failed_plans_are_told_apart_by_their_colours(tmp_path, drawn):
    draw_flight(in_trouble(), SCORED_S, "", tmp_path / "x.png")

    lines = drawn["computing time of a tick"].get_lines()
    kinds = {line.get_label(): line.get_color() for line in lines if line.get_label()[0] != "_"}
    assert list(kinds) == ["L1 only", "MPC, closed form", "MPC, constraint active (QP)"]
    assert len(set(kinds.values())) == len(kinds)


def test_the_error_is_drawn_on_the_scale_of_the_scored_part(tmp_path, drawn):
    data = whole()
    position = data.ticks.position_enu_m.copy()
    position[:300] += 5.0  # the approach begins 9 m away
    ticks = replace(data.ticks, position_enu_m=position)

    draw_flight(FlightData(ticks, data.truth), SCORED_S, "", tmp_path / "x.png", 25.0)

    low, high = drawn["tracking error"].get_ylim()
    assert (low, high) == pytest.approx((0.0, 11.5), abs=0.1)
    limits = [line.get_ydata()[0] for line in drawn["commanded tilt"].get_lines()]
    assert {25.0, -25.0} <= set(limits)
