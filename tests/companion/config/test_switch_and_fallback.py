"""Planned hand-overs and fallbacks: how they are written, and what they lead to."""

import pytest

from companion.config.relief import NO_FALLBACK
from companion.config.resolve import configs_folder, load_flight
from companion.config.yaml_source import ConfigError

MPC_L1 = configs_folder() / "controllers" / "mpc-l1" / "bebop2.yaml"


def load(switch=(), **settings):
    return load_flight(
        None, {"switch": list(switch)} if switch else {}, {k: str(v) for k, v in settings.items()}
    )


def test_a_hand_over_is_read_as_the_command_line_has_it():
    config = load(["t=8:pid-l1", "t=1.5:l1-off"])
    assert [(s.at_s, s.to, s.controller) for s in config.mission.switch] == [
        (8.0, "pid-l1", "pid-l1"),
        (1.5, "l1-off", None),
    ]
    assert set(config.others) == {"pid-l1"}
    assert config.others["pid-l1"].framework == "pid-l1"


@pytest.mark.parametrize("text", ["8:mpc-l1", "t=8", "t=8:", "t=soon:mpc-l1", "t=1-2:mpc-l1"])
def test_what_is_no_hand_over_is_told_with_an_example(text):
    with pytest.raises(ConfigError, match="t=8:mpc-l1"):
        load([text])


@pytest.mark.parametrize("at", ["-1", "-0.001"])
def test_a_hand_over_before_the_trajectorys_start_is_refused(at):
    with pytest.raises(ConfigError, match=f"t={at} is before the trajectory's start"):
        load([f"t={at}:pid-l1"])


@pytest.mark.parametrize("at_s", ["-1", ".nan", ".inf"])
def test_so_is_it_in_a_missions_file(tmp_path, at_s):
    mission = tmp_path / "mission.yaml"
    mission.write_text(f"switch: [{{at_s: {at_s}, to: pid-l1}}]\n")
    with pytest.raises(ConfigError, match="at_s"):
        load_flight(mission, {}, {})


def test_an_unknown_controller_is_told_before_the_flight():
    with pytest.raises(ConfigError, match="unknown controller 'nope'"):
        load(["t=8:nope"])


def test_the_configured_controller_is_handed_back_to_with_its_settings():
    config = load(["t=8:pid-l1", "t=12:mpc-l1"], **{"controller.mpc.horizon": 40})
    assert set(config.others) == {"pid-l1"}
    assert config.controller.mpc.horizon == 40


def test_only_mpc_l1_plus_has_a_fallback_that_nobody_named():
    assert load().controller.fallback is None
    plus = load_flight(None, {"controller": "mpc-l1-plus"}, {})
    assert plus.controller.fallback == "mpc-l1"
    assert set(plus.others) == {"mpc-l1"}
    without = load_flight(None, {"controller": "mpc-l1-plus"}, {"controller.fallback": NO_FALLBACK})
    assert without.controller.fallback is None
    assert not without.others


def test_a_fallback_of_a_controllers_file_lies_beside_it(tmp_path, monkeypatch):
    text = MPC_L1.read_text()
    (tmp_path / "robust.yaml").write_text(text)
    (tmp_path / "own.yaml").write_text(text + "fallback: robust.yaml\n")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    config = load_flight(None, {"controller": "../own.yaml"}, {})
    assert config.controller.fallback == "../robust.yaml"
    assert config.others["../robust.yaml"].framework == "mpc-l1"


def test_a_controllers_file_in_a_missions_hand_over_lies_beside_the_mission(tmp_path, monkeypatch):
    (tmp_path / "own.yaml").write_text(MPC_L1.read_text())
    mission = tmp_path / "mission.yaml"
    mission.write_text("switch: ['t=3:own.yaml', {at_s: 5, to: own.yaml}]\n")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    config = load_flight(mission, {}, {})
    names = {switch.to for switch in config.mission.switch}
    assert names == set(config.others) == {str(tmp_path / "own.yaml")}
