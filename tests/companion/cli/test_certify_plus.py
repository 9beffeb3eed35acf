"""`companion certify mpc-l1-plus`: exit statuses, what is told, and the files."""

import json
import math

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.config.resolve import configs_folder


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, ["certify", "mpc-l1-plus", *arguments])


def certificate(*arguments, status):
    result = run(*arguments, "--json")
    assert result.exit_code == status, result.output
    return json.loads(result.stdout)


@pytest.mark.parametrize("vehicle", ["bebop2", "x500", "sih_quadx", "arducopter"])
def test_the_shipped_controllers_are_certified(vehicle):
    record = certificate("--vehicle", vehicle, status=0)
    assert record["holds"] is True
    assert record["failures"] == []
    assert record["framework"] == "mpc-l1-plus"
    for axis in record["axes"]:
        assert axis["radius"] < 1.0
        margins = axis["margins"]
        assert margins["gain_down"] < 0.75
        assert margins["gain_up"] > 1.3
        assert margins["delay_s"] > 0.02
        assert margins["modulus"] > 0.2
        assert axis["velocity_gain_s"] * axis["lipschitz_1_s"] < 1.0
        adapting, held = axis["response"], axis["response_without_adaptation"]
        assert adapting["gust_m"] < held["gust_m"]
        assert abs(adapting["rest_m"]) < 1e-6 < abs(held["rest_m"])
        assert all(m["stable"] for m in axis["family"] if not m["hard"])


def test_what_the_vehicle_takes_is_certified():
    axes = {v: certificate("--vehicle", v, status=0)["axes"] for v in ("x500", "arducopter")}
    interfaces = {v: a[2]["plant"]["actuation"]["interface"] for v, a in axes.items()}
    assert interfaces == {"x500": "acceleration", "arducopter": "climb_rate"}


def test_the_table_says_what_holds_and_the_files_hold_it_all(here):
    result = run("--vehicle", "x500", "--out", "found/here")
    assert result.exit_code == 0, result.output
    assert "certified: every condition holds" in result.stdout
    assert "What is learnt in flight (lag, drag, gain, heading) is not in it." in result.stdout
    for line in ("modulus margin with", "lag + 50 %", "delay margin, ms", "‖G‖ L < 1", "gusts, mm"):
        assert line in result.stdout
    folder = here / "found" / "here"
    assert (folder / "certificate.png").read_bytes().startswith(b"\x89PNG")
    record = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
    assert record == certificate("--vehicle", "x500", status=0)


def test_a_feedback_that_is_too_quick_fails_with_its_reason():
    too_quick = "controller.plus.bandwidth_rad_s=[18, 18, 18]"
    result = run("--set", too_quick)
    assert result.exit_code == 1
    assert "not certified" in result.stdout
    record = certificate("--set", too_quick, status=1)
    failures = {(f["axis"], f["condition"]): f["reason"] for f in record["failures"]}
    assert "lower bandwidth_rad_s" in failures["z", "stable over the family"]
    margins = record["axes"][2]["margins"]
    assert all(value is None or math.isfinite(value) for value in margins.values())


def test_a_storm_breaks_the_norm_condition():
    record = certificate("--wind", "45", status=1)
    assert {f["condition"] for f in record["failures"]} == {"‖G‖ L < 1"}


def test_another_rate_is_another_loop():
    slow, usual = (certificate("--rate", rate, status=0) for rate in ("80", "100"))
    assert slow["rate_hz"] == pytest.approx(80.0)
    assert slow["axes"][0]["radius"] != usual["axes"][0]["radius"]


def test_a_vehicle_without_stated_dynamics_is_bad_input(here):
    text = (configs_folder() / "vehicles/bebop2.yaml").read_text(encoding="utf-8")
    (here / "v.yaml").write_text(text[: text.index("dynamics:")], encoding="utf-8")
    result = run("--vehicle", "v.yaml")
    assert result.exit_code == 2
    assert "has no `dynamics`" in " ".join(result.stderr.split())
