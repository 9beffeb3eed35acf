import json
import os
import re
import shutil
import signal
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.commands import tune as tune_command
from companion.commands.tune import TuneRequest, run_tune
from companion.config.resolve import configs_folder, load_flight
from companion.config.yaml_source import ConfigError
from companion.experiments.identify_steps import SecondOrder
from companion.experiments.tuned_gains import TUNED
from tests.flights.bench import SHORT

BASELINES = ("pid-l1", "lqr-l1", "pid")


def cost(gains):
    """Least where every gain is 0.1."""
    return sum(abs(value - 0.1) for values in gains.values() for value in values)


@pytest.mark.parametrize("controller", BASELINES)
def test_a_controller_is_written_that_flies_and_says_where_it_came_from(controller, tmp_path):
    out = tmp_path / "mine.yaml"
    run_tune(TuneRequest(controller, budget=40, seed=3, out=out), cost)

    written = load_flight(None, {"controller": str(out)}, {}).controller
    shipped = load_flight(None, {"controller": controller}, {}).controller
    assert written.framework == controller
    assert written.l1 == shipped.l1
    assert "companion tune" in written.source
    assert "--budget 40 --starts 2 --seed 3" in written.source
    costs = re.findall(r"(\w+) start [\d.]+ → ([\d.]+) mm in 20 sets of gains", written.source)
    assert [name for name, _ in costs] == ["gentle", "aggressive"]
    trials = [json.loads(line) for line in (tmp_path / "mine.jsonl").read_text().splitlines()]
    assert [trial["number"] for trial in trials] == list(range(1, 41))
    best = min(trials, key=lambda trial: trial["evaluation"]["cost_m"])
    assert min(float(mm) for _, mm in costs) == pytest.approx(
        best["evaluation"]["cost_m"] * 1e3, abs=0.06
    )
    for key, values in best["gains"].items():
        section, _, name = key.partition(".")
        assert getattr(getattr(written, section), name) == tuple(values)
    assert {tuned.key for tuned in TUNED[controller]} == set(best["gains"])


def test_the_same_search_writes_the_same_bytes(tmp_path):
    written = []
    for name in ("one", "two"):
        out = tmp_path / name / "a.yaml"
        run_tune(TuneRequest("pid-l1", budget=30, out=out), cost)
        written.append((out.read_bytes(), out.with_suffix(".jsonl").read_bytes()))

    assert written[0] == written[1]


def test_mpc_pid_gets_the_tuned_pid_the_identified_model_and_the_mpc_of_mpc_l1(
    tmp_path, monkeypatch
):
    models = [SecondOrder(2.0, 0.5, 0.02), SecondOrder(2.1, 0.6, 0.02), SecondOrder(3.0, 1.0, 0.01)]
    monkeypatch.setattr(tune_command, "_identify", lambda *_: models)
    out = tmp_path / "a.yaml"

    run_tune(TuneRequest("mpc-pid", budget=30, out=out), cost)

    written = load_flight(None, {"controller": str(out)}, {}).controller
    pid = load_flight(None, {"controller": "pid"}, {}).controller
    assert written.framework == "mpc-pid"
    assert written.mpc == load_flight(None, {"controller": "mpc-l1"}, {}).controller.mpc
    assert written.mpc_model.m == pytest.approx((2.0, 2.52, 6.0))
    assert written.mpc_model.k == pytest.approx((2.0, 1.75, 1.5))
    assert written.inner_pid.integral_limit == pid.inner_pid.integral_limit
    assert "x ω 2.00 rad/s ζ 0.50" in written.source


@pytest.mark.parametrize(("part", "sections"), [("model", 1), ("whole", 2)])
def test_a_part_of_mpc_pid_is_searched_from_where_its_file_stands(part, sections, tmp_path):
    out = tmp_path / "a.yaml"
    run_tune(TuneRequest("mpc-pid", budget=30, out=out, part=part), cost)

    shipped = load_flight(None, {"controller": "mpc-pid"}, {}).controller
    written = load_flight(None, {"controller": str(out)}, {}).controller
    changed = [n for n in ("mpc_model", "inner_pid") if getattr(written, n) != getattr(shipped, n)]
    assert len(changed) == sections
    assert written.mpc == shipped.mpc
    assert f"--seed 1 --part {part}" in written.source
    first = json.loads((tmp_path / "a.jsonl").read_text().splitlines()[0])
    assert first["start"] == "as it stands"
    begun = first["gains"]["mpc_model.m"]  # one value for x and y: that of x
    assert (begun[0], begun[2]) == pytest.approx(shipped.mpc_model.m[::2], rel=1e-3)


def test_the_best_of_a_few_flights_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.csv").write_text(SHORT)

    said = CliRunner().invoke(
        app, ["tune", "pid", "--traj", "short.csv", "--budget", "4", "--jobs", "1"]
    )

    assert said.exit_code == 0, said.output
    assert "tuning pid: 8 of 8 flights" in said.stderr
    trials = (tmp_path / "tuned" / "pid-bebop2.jsonl").read_text().splitlines()
    costs = [json.loads(line)["evaluation"]["cost_m"] for line in trials]
    assert f"cost      {min(costs) * 1e3:.1f} mm" in said.stdout
    assert 0.0 < min(costs) < 5.0  # gains that leave the geofence are lost, and cost more
    assert load_flight(None, {"controller": "tuned/pid-bebop2.yaml"}, {}).controller.inner_pid


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["nonsense"], "unknown controller 'nonsense'"),
        (["mpc-l1"], "is not tuned by flights"),
        (["pid", "--vehicle", "x500"], "there is no 'pid' for the vehicle 'x500'"),
        (["pid", "--traj", "nowhere.csv"], "nowhere.csv"),
        (["pid", "--traj", "9"], "1 to 5"),
        (["pid", "--budget", "1"], "--budget 1 is too small for --starts 2"),
        (["pid", "--starts", "0"], "--starts 0"),
        (["pid", "--jobs", "0"], "--jobs"),
        (["pid", "--part", "model"], "--part model: of mpc-pid give one of"),
        (["mpc-pid", "--part", "half"], "--part half"),
        (["pid", "--out", "a.jsonl"], "ends in .yaml"),
        (["pid", "--out", "folder.yaml"], "that is a folder"),
        (["mine.yaml"], "tune 'mpc-pid' by its name"),
    ],
)
def test_what_can_not_be_tuned_is_said_before_anything_is_begun(
    options, said, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.yaml").mkdir()
    shutil.copy(configs_folder() / "controllers" / "mpc-pid" / "bebop2.yaml", "mine.yaml")

    result = CliRunner().invoke(app, ["tune", *options])

    assert result.exit_code == 2
    assert said in result.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.yaml", "mine.yaml"]


def test_a_vehicle_that_the_trajectory_is_too_fast_for_is_told_at_once(tmp_path):
    slow = tmp_path / "slow.yaml"
    shipped = load_flight(None, {}, {}).vehicle.model_dump(mode="json", exclude={"dynamics"})
    shipped["speed_limit_m_s"] = 0.1
    slow.write_text(json.dumps(shipped))

    with pytest.raises(ConfigError, match=r"0\.1"):
        run_tune(TuneRequest("pid", vehicle=str(slow), out=tmp_path / "a.yaml"))

    assert list(tmp_path.iterdir()) == [slow]


def test_an_interrupt_keeps_the_log_writes_no_controller_and_says_so(tmp_path):
    running = subprocess.Popen(
        [sys.executable, "-m", "companion", "tune", "pid", "--jobs", "1"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.getcwd()},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    log = tmp_path / "tuned" / "pid-bebop2.jsonl"
    assert running.stderr.readline() == "tuning pid: 0 of 600 flights\n"
    running.send_signal(signal.SIGINT)
    _, said = running.communicate(timeout=60)

    assert running.returncode == 4
    assert said.startswith("error: interrupted: no controller was written.")
    assert "Traceback" not in said
    assert [path.name for path in log.parent.iterdir()] == [log.name]
