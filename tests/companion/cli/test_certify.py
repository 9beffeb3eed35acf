"""`companion certify`: exit statuses, what is told, and the files."""

import json

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.config.resolve import configs_folder

TOO_QUICK = ("--set", "controller.l1.omega=[3, 3, 4]", "--set", "controller.l1.m=[0.5, 0.5, 3.75]")
EULER = ("--set", "controller.l1.discretisation=euler")


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, ["certify", *arguments])


def certificate(*arguments, status):
    result = run(*arguments, "--json")
    assert result.exit_code == status, result.output
    assert result.stdout.count("\n") == 1
    assert result.stderr == ""
    return json.loads(result.stdout)


def failures(record, axis):
    return {f["condition"]: f["reason"] for f in record["failures"] if f["axis"] == axis}


@pytest.mark.parametrize("vehicle", ["bebop2", "x500"])
def test_the_shipped_controllers_are_certified(vehicle):
    record = certificate("mpc-l1", "--vehicle", vehicle, status=0)
    assert record["holds"] is True
    assert record["failures"] == []
    assert record["vehicle"] == vehicle
    for axis in record["axes"]:
        assert axis["norm_g"]["value"] * axis["lipschitz"] < 1.0
        assert axis["lipschitz"] < axis["largest_lipschitz"]
        assert 0.0 < axis["gamma_0_m_s"] < axis["gamma_1_m_s"]
        assert axis["whole_radius"] < 1.0
        ends = axis["gamma_range"]
        assert ends["low"] < axis["gains"]["gamma"] < ends["safe_high"] < ends["high"]
        whole = axis["margins"]["whole"]
        assert whole["gain_down"] < 1.0 < whole["gain_up"]
        assert whole["delay_s"] > 0.02


def test_a_low_pass_filter_that_is_too_quick_fails_with_its_reason():
    record = certificate("mpc-l1", *TOO_QUICK, status=1)
    assert record["holds"] is False
    for axis in ("x", "y"):
        reasons = failures(record, axis)
        assert "lower ω, or raise m" in reasons["H(s) stable"]
        assert "‖G‖ is infinite" in reasons["‖G‖ L < 1"]
        assert "does not stabilise" in reasons["sampled, with outer loop"]
    assert failures(record, "z") == {}
    x = record["axes"][0]
    assert x["norm_g"] is None
    assert x["gamma_1_m_s"] is None
    assert x["margins"]["continuous"] is None
    assert x["poles_of_h_1_s"][0][0] > 0.0


def test_explicit_euler_beyond_its_limit_fails_with_its_reason():
    record = certificate("mpc-l1", *EULER, status=1)
    for axis, gamma_dt in (("x", "3"), ("z", "10")):
        reason = failures(record, axis)["discrete adaptation law stable"]
        assert reason == "explicit Euler is stable only for Γ dt < 1, that is Γ < 100"
        axes = {a["axis"]: a for a in record["axes"]}
        found = {c["name"]: c["found"] for c in axes[axis]["conditions"]}
        assert found["discrete adaptation law stable"].endswith(f"euler, Γ dt = {gamma_dt}")


def test_a_rate_that_is_stable_but_not_safe_is_certified_with_caution_and_its_noise():
    arguments = ("mpc-l1", "--set", "controller.l1.gamma=[190000, 190000, 1000]")
    result = run(*arguments)
    assert result.exit_code == 0
    assert "caution on x, y (Γ in the stable range): stable but not safe" in result.stdout
    record = certificate(*arguments, status=0)
    x = record["axes"][0]
    caution = next(c["caution"] for c in x["conditions"] if c["name"] == "Γ in the stable range")
    assert f"{x['noise']['y_tilde_per_velocity']:.3g} × to ỹ" in caution
    assert x["noise"]["y_tilde_per_velocity"] > 10.0


def test_an_absurd_rate_fails_with_its_reason_and_the_true_range():
    result = run("mpc-l1", "--set", "controller.l1.gamma=[1e12, 300, 1000]")
    assert result.exit_code == 1
    said = "fails on x (Γ in the stable range): the adaptation mode √(mΓ) lies above half the"
    assert said in result.stdout
    assert "Γ = 1e+12; stable: 223 < Γ < 1.97e+05" in result.stdout
    assert "radius 0.9975; exact, Γ dt = 1e+10" in result.stdout


def test_a_storm_breaks_the_norm_condition():
    record = certificate("mpc-l1", "--wind", "45", status=1)
    assert "fly slower or in less wind" in failures(record, "x")["‖G‖ L < 1"]
    assert record["axes"][0]["gamma_1_m_s"] is None


def test_a_projection_bound_below_what_the_limits_need_fails():
    record = certificate("mpc-l1", "--set", "controller.l1.sigma_bound=[3, 16, 8]", status=1)
    assert "raise sigma_bound to" in failures(record, "x")["projection leaves σ free"]


def test_the_table_says_what_holds_and_the_files_hold_it_all(here):
    result = run("mpc-l1", "--vehicle", "x500", "--out", "found/here")
    assert result.exit_code == 0, result.output
    assert "certified: every condition holds" in result.stdout
    cautious = "caution on" in result.stdout
    assert ("every condition holds, with caution" in result.stdout) == cautious
    for line in ("H(s) stable", "‖G‖", "γ0, m/s", "gain margin, whole loop", "least stable Γ"):
        assert line in result.stdout
    folder = here / "found" / "here"
    assert (folder / "certificate.png").read_bytes().startswith(b"\x89PNG")
    record = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
    assert record == certificate("mpc-l1", "--vehicle", "x500", status=0)


def test_the_table_gives_the_reason_of_a_failure_once_for_axes_that_share_it():
    """An adaptation rate that is too low for x and y."""
    result = run("mpc-l1", "--set", "controller.l1.gamma=[100, 100, 1000]")
    assert result.exit_code == 1
    assert "not certified" in result.stdout
    assert result.stdout.count("fails on x, y (Γ in the stable range): with Γ below ") == 1
    assert "the estimate lags behind what the loop needs" in result.stdout


def test_nothing_is_written_unasked(here):
    assert run("l1").exit_code == 0
    assert list(here.iterdir()) == []


def test_a_controller_by_its_path_with_transfer_functions(here):
    (here / "own.yaml").write_text(
        """
framework: l1
source: a test
l1:
  reference_model:
    - {numerator: [0.5], denominator: [1, 0.5]}
    - {numerator: [0.55, 1.65], denominator: [1, 3.5, 1.65]}
    - {numerator: [3.75], denominator: [1, 3.75]}
  low_pass:
    - {numerator: [0.2], denominator: [1, 0.2]}
    - {numerator: [0.2], denominator: [1, 0.2]}
    - {numerator: [5, 6], denominator: [1, 5, 6]}
  k: [0.5, 0.5, 0.5]
  gamma: [400, 400, 1000]
  sigma_bound: [20, 20, 12]
""",
        encoding="utf-8",
    )
    record = certificate("own.yaml", status=0)
    assert all(axis["gamma_0_m_s"] > 0.0 for axis in record["axes"])


def refused(*arguments):
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    return " ".join(result.stderr.split())


@pytest.mark.parametrize("controller", ["mpc-pid", "pid"])
def test_a_framework_without_l1_is_none_of_its_business(controller):
    said = refused(controller)
    assert f"{controller}: certify speaks of L1 controllers" in said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("lqg",), "unknown controller 'lqg'"),
        (("none.yaml",), "none.yaml: no such file"),
        (("mpc-l1", "--vehicle", "dc3"), "unknown vehicle 'dc3'"),
        (("mpc-l1", "--rate", "5"), "state_rate_hz"),
        (("mpc-l1", "--rate", "nan"), "state_rate_hz"),
        (("mpc-l1", "--rate", "31.4159"), "no common period"),
        (("mpc-l1", "--wind", "-1"), "--wind -1: give a speed from 0 to 50 m/s"),
        (("mpc-l1", "--wind", "nan"), "--wind nan: give a speed"),
        (("mpc-l1", "--set", "controller.l1.gamma"), "write KEY=VALUE"),
        (("mpc-l1", "--set", "controller.l1.gamma=[0, 1, 1]"), "l1.gamma.0"),
        (
            ("mpc-l1", "--set", "controller.l1.gamma=[300, 1e40, 1000]"),
            "Γ = 1e+40 on y is beyond what a step of the law can be reckoned with",
        ),
        ((), "Missing argument"),
    ],
)
def test_bad_input(arguments, says):
    assert says in refused(*arguments)


def test_a_vehicle_without_stated_dynamics(here):
    text = (configs_folder() / "vehicles/bebop2.yaml").read_text(encoding="utf-8")
    (here / "v.yaml").write_text(text[: text.index("dynamics:")], encoding="utf-8")
    assert "has no section 'dynamics', so that A(s) is not known" in refused(
        "mpc-l1", "--vehicle", "v.yaml"
    )


def test_a_folder_that_can_not_be_made(here):
    (here / "file").write_text("taken")
    assert "file: can't be written" in refused("mpc-l1", "--out", "file")
