"""`companion compare`: what it flies, tells and writes, and how it ends when it can't."""

import json
import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.commands import compare as compare_command
from companion.commands.compare import CompareRequest, run_compare
from companion.config.resolve import configs_folder
from companion.experiments.campaign import CampaignInterruptedError
from companion.experiments.compare import Grid
from tests.companion.experiments import stand_ins


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def request(*controllers, **changes):
    fields = {"trajectories": (1, 4), "seeds": 2, "jobs": 1}
    return CompareRequest(controllers, **(fields | changes))


def test_it_flies_tells_and_writes_and_goes_on_where_it_was(here, capsys):
    asked = request("mpc-l1", "pid-l1", winds=("calm", "fan"), perturb=("loss10",))

    comparison = run_compare(asked, stand_ins.keep_made_up)

    table = capsys.readouterr().out
    assert len(list((here / "compare" / "flown").iterdir())) == 2 * 2 * 2 * 2 * 2
    assert (here / "compare" / "compare.png").read_bytes().startswith(b"\x89PNG")
    written = json.loads((here / "compare" / "compare.json").read_text())
    assert written["command"] == (
        "companion compare mpc-l1 pid-l1 --vehicle bebop2 --traj 1,4 --wind calm --wind fan "
        "--perturb loss10 --seeds 2"
    )
    cells = {(c["controller"], c["wind"], c["perturbation"]): c for c in written["cells"]}
    perturbed = cells["mpc-l1", "fan", "loss10"]
    assert perturbed["mean_error_m"] == pytest.approx(0.045)  # thrice 10 and 20 mm
    assert perturbed["spread_m"] == pytest.approx(0.03 / 2**0.5)
    assert perturbed["ratio_to_nominal"] == pytest.approx(3.0)
    assert not perturbed["bears"]
    assert cells["pid-l1", "calm", "nominal"]["ratio_to_first"] == pytest.approx(1.0)
    lost = cells["pid-l1", "fan", "nominal"]
    assert (lost["lost"], lost["mean_error_m"], lost["bears"]) == (4, None, False)
    assert re.search(r"pid-l1, fan, nominal, trajectory 1 \(seed 1\).*It flew away", table)
    assert "lost 4 of 4" in table
    assert re.search(r"lost 4 of 4 .* 0\.50 +2\.0 ", table)

    again = run_compare(asked, stand_ins.keep_made_up)  # it would fail if it flew one twice
    assert repr(again.cells) == repr(comparison.cells)  # some of what is not known is NaN


def test_errors_may_be_against_the_reported_position_without_flying_anew(capsys):
    true = run_compare(request("mpc-l1"), stand_ins.keep_made_up).cells[0]
    capsys.readouterr()
    comparison = run_compare(request("mpc-l1", against="reported"), stand_ins.keep_made_up)
    reported = comparison.cells[0]
    assert reported.mean_error_m == pytest.approx(2.0 * true.mean_error_m)
    assert (true.peak_height_error_m, reported.peak_height_error_m) == (0.004, 0.007)
    assert "against the reported position" in capsys.readouterr().out
    assert comparison.command.endswith("--against reported")


def test_two_controllers_whose_files_say_the_same_share_their_flights(here):
    shipped = configs_folder() / "controllers" / "mpc-l1" / "bebop2.yaml"
    shutil.copy(shipped, here / "mpc-l1.yaml")
    comparison = run_compare(request("mpc-l1", "copy=mpc-l1.yaml"), stand_ins.keep_made_up)
    assert comparison.controllers == ("mpc-l1", "copy")
    assert comparison.cells[0].flights == comparison.cells[1].flights


def test_json_is_one_object_and_nothing_else(capsys):
    run_compare(request("mpc-l1", json_output=True), stand_ins.keep_made_up)
    printed = json.loads(capsys.readouterr().out)
    assert printed["controllers"] == ["mpc-l1"]


def compare(*options):
    return CliRunner().invoke(app, ["compare", *options])


def asked_of(monkeypatch):
    seen = []
    monkeypatch.setattr(compare_command, "run_compare", seen.append)
    return seen


def test_the_options_are_what_is_asked_for(monkeypatch):
    seen = asked_of(monkeypatch)
    options = "a b --vehicle x500 --autopilot ardupilot --traj 4,own.csv --wind calm --wind fan"
    more = "--perturb lag+25 --perturb combo --seeds 3 --whole --against reported --set hover_s=1"

    result = compare(*options.split(), *more.split(), "--jobs", "1", "--out", "here")

    assert result.exit_code == 0, result.output
    (found,) = seen
    assert found.controllers == ("a", "b")
    assert (found.vehicle, found.autopilot, found.setpoint) == ("x500", "ardupilot", None)
    assert found.trajectories == (4, "own.csv")
    assert (found.winds, found.perturb) == (("calm", "fan"), ("lag+25", "combo"))
    assert (found.seeds, found.whole, found.against) == (3, True, "reported")
    assert (found.settings, found.jobs, str(found.out)) == (("hover_s=1",), 1, "here")


def test_the_autopilot_and_the_setpoints_reach_every_flight():
    grid: Grid = compare_command._grid(request("mpc-l1", autopilot="ardupilot", setpoint="rates"))
    assert dict(grid.settings) == {"autopilot": "ardupilot", "setpoint": "rates"}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("nothing",), "unknown controller 'nothing'"),
        (("mpc-l1", "--perturb", "rain"), "--perturb rain: no such perturbation"),
        (("mpc-l1", "--wind", "storm"), "unknown scenario 'storm'"),
        (("mpc-l1", "--against", "luck"), "--against luck: give truth or reported"),
        (("mpc-l1", "--seeds", "0"), "--seeds 0"),
        (("mpc-l1", "--jobs", "0"), "--jobs 0"),
        (("mpc-l1", "--traj", "7"), "test trajectories are numbered 1 to 5"),
        (("mpc-l1", "--traj", "none.csv"), "none.csv"),
        (("mpc-l1", "--set", "hover_s"), "hover_s"),
        (("mpc-l1", "--sensors", "foo"), "there is no sensor profile 'foo'"),
        (("mpc-l1", "--sensors", "foo.yaml"), "foo.yaml: no such sensor profile"),
        (("mpc-l1", "--set", "sensors=foo"), "there is no sensor profile 'foo'"),
    ],
)
def test_what_can_not_be_compared_is_bad_input(options, said):
    result = compare(*options)
    assert result.exit_code == 2
    assert said in result.output
    assert "Traceback" not in result.output
    assert not list(Path("compare").rglob("*.parquet"))


def test_what_is_told_of_the_flights_is_what_was_flown(capsys):
    settings = ("autopilot=ardupilot", "setpoint=rates", "sensors=exact")
    by_setting = run_compare(request("mpc-l1", settings=settings), stand_ins.keep_made_up)
    assert "bebop2, ardupilot: mean" in capsys.readouterr().out
    written = json.loads((Path("compare") / "compare.json").read_text())
    for told in (by_setting.autopilot, written["autopilot"]):
        assert told == "ardupilot"
    assert (by_setting.setpoint, by_setting.sensors) == ("rates", "exact")
    plain = run_compare(request("mpc-l1", sensors="mocap"), stand_ins.keep_made_up)
    assert (plain.autopilot, plain.setpoint, plain.sensors) == ("px4", "attitude", "mocap")


def test_where_not_one_flight_can_be_flown_it_says_so_and_ends_as_with_bad_input(monkeypatch):
    campaign = compare_command.run_campaign
    monkeypatch.setattr(
        compare_command, "run_campaign", lambda *given: campaign(*given[:-1], stand_ins.refuse)
    )
    result = compare("mpc-l1", "--traj", "1", "--seeds", "2", "--jobs", "1")
    assert result.exit_code == 2
    assert "lost 2 of 2" in result.output
    assert "not one of 2 flights could be flown: It is too fast." in result.output


def test_one_flight_that_fails_beside_others_is_a_result():
    one = compare_command.run_compare(
        request("mpc-l1", trajectories=(1,), seeds=3), stand_ins.raise_at_two
    )
    assert one.cells[0].lost == 1


def test_an_interrupt_says_how_to_go_on(monkeypatch):
    def interrupted(*_):
        raise CampaignInterruptedError("interrupted: 3 of 9 flights are kept in compare.")

    monkeypatch.setattr(compare_command, "run_campaign", interrupted)
    result = compare("mpc-l1")
    assert result.exit_code == 4
    assert "3 of 9 flights are kept" in result.output
