"""The shell's tabulator key, driven as bash, zsh and fish drive it."""

import io
import os
import subprocess
import sys
from contextlib import redirect_stdout

import pytest

from companion.cli import app, bash_words, completion
from companion.config.folders import configs_folder, shipped_controllers, shipped_names
from companion.experiments.perturbations import NOMINAL, PERTURBATIONS
from companion.flight.command_socket import socket_folder

HEAVY = ("numpy", "scipy", "yaml", "rich", "pymavlink", "matplotlib", "mcap")


def run(monkeypatch, **environment):
    """What the program prints for a shell that asks."""
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    said = io.StringIO()
    with redirect_stdout(said), pytest.raises(SystemExit):
        bash_words.run(lambda: app(prog_name="companion"), os.environ)
    return said.getvalue()


@pytest.fixture
def bash(monkeypatch, tmp_path):
    """Completes the last of some words, as bash breaks them."""
    monkeypatch.chdir(tmp_path)

    def complete(*words):
        return run(
            monkeypatch,
            _COMPANION_COMPLETE="complete_bash",
            COMP_WORDS="\n".join(("companion", *words)),
            COMP_CWORD=str(len(words)),
        ).split()

    return complete


def test_commands_and_options(bash):
    assert bash("ca") == ["campaign"]
    assert bash("fly", "--contr") == ["--controller"]
    assert set(bash("")) >= {"fly", "new", "schema", "doctor"}


def test_trajectories_by_number_and_files_of_the_folder(bash, tmp_path):
    for name in ("loop.csv", "notes.txt", "m.yaml"):
        (tmp_path / name).touch()
    assert bash("fly", "--traj", "") == ["1", "2", "3", "4", "5", "loop.csv", "m.yaml"]
    assert bash("fly", "--traj", "l") == ["loop.csv"]
    assert bash("compare", "mpc-l1", "--traj", "1,2,") == ["1,2,3", "1,2,4", "1,2,5"]


def test_files_of_another_folder(bash, tmp_path):
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "x.yaml").touch()
    assert bash("check", "--vehicle", "own/") == ["own/x.yaml"]
    assert bash("check", "--vehicle", "no/such/") == []


def test_shipped_names(bash):
    assert bash("compare", "mpc-l") == ["mpc-l1", "mpc-l1-plus"]
    assert bash("check", "--vehicle", "") == shipped_names("vehicle")
    assert set(bash("compare", "--wind", "")) == {"fan", *shipped_names("scenario")}
    assert bash("campaign", "") == shipped_names("campaign")
    assert set(bash("replay", "x", "--controller", "")) == set(shipped_controllers())
    assert bash("schema", "mis") == ["mission"]
    assert bash("new", "sc") == ["scenario"]
    assert bash("check", "--autopilot", "") == ["px4", "ardupilot", "auto"]


def test_only_what_has_a_theory_is_certified(bash):
    found = bash("certify", "")
    assert {"mpc-l1", "l1", "mpc-l1-plus", "lqr-l1"} <= set(found)
    assert not {"pid", "mpc-pid"} & set(found)


def test_rows_of_the_table_of_faults(bash):
    rows = bash("faults", "--only", "")
    text = (configs_folder() / "fault-table.yaml").read_text()
    assert len(rows) == text.count("  - name: ") > 10
    assert "loss" in rows


def test_logs_newest_first_and_campaigns(bash, tmp_path):
    for folder in ("flights/20260101-a", "flights/20260202-b", "flights/empty", "mine"):
        (tmp_path / folder).mkdir(parents=True)
        if "empty" not in folder:
            (tmp_path / folder / "flight.mcap").touch()
    (tmp_path / "campaigns" / "brief").mkdir(parents=True)
    (tmp_path / "campaigns" / "brief" / "campaign.json").touch()
    assert bash("replay", "flights/") == ["flights/20260202-b", "flights/20260101-a"]
    assert set(bash("recover", "")) == {"mine", "flights/20260202-b", "flights/20260101-a"}
    assert set(bash("report", "")) == {"campaigns/brief", *bash("recover", "")}


def test_running_flights(bash, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert bash("land", "--pid", "") == []
    socket_folder().mkdir()
    (socket_folder() / "4711.sock").touch()
    assert bash("land", "--pid", "") == ["4711"]


def test_keys_of_set_and_their_choices(bash):
    assert bash("check", "--set", "hover") == ["hover_s="]
    assert "geofence.low_m=" in bash("check", "--set", "geo")
    assert "controller.mpc.horizon=" in bash("check", "--set", "controller.mpc.")
    assert "vehicle.tilt_limit_deg=" in bash("check", "--set", "vehicle.t")
    assert bash("check", "--set", "autopilot", "=", "p") == ["px4"]


def test_words_that_bash_breaks_are_completed_from_where_they_broke():
    def to(*words):
        return bash_words.glued(["companion", *words], len(words))

    assert to("fly", "--switch", "t", "=", "8", ":", "mp") == (
        ["companion", "fly", "--switch", "t=8:mp"], 3, "t=8:",
    )  # fmt: skip
    assert to("fly", "--switch", "t", "=", "8", ":") == (
        ["companion", "fly", "--switch", "t=8:"], 3, "t=8:",
    )  # fmt: skip
    assert to("fly", "--controller", "=", "l")[0] == ["companion", "fly", "--controller=l"]
    plain = ["fly", "--wind", "fan", "--seed", ""]
    assert to(*plain) == (["companion", *plain], 5, "")


def test_options_with_an_equals_sign_in_bash(bash):
    assert bash("check", "--vehicle", "=", "x") == ["x500"]
    assert bash("compare", "first", "=", "mpc-l1-") == ["mpc-l1-plus"]


@pytest.fixture
def zsh(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    return lambda line: run(
        monkeypatch, _COMPANION_COMPLETE="complete_zsh", _TYPER_COMPLETE_ARGS=line
    )


def test_zsh_gets_values_with_what_they_are(zsh):
    assert '"4":"figure-eight"' in zsh("companion check --traj ")
    assert zsh("companion report ") == "_files\n"


def test_fish_gets_values_with_what_they_are(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    asked = {"_COMPANION_COMPLETE": "complete_fish",
             "_TYPER_COMPLETE_ARGS": "companion check --setpoint "}  # fmt: skip
    said = run(monkeypatch, _TYPER_COMPLETE_FISH_ACTION="get-args", **asked)
    assert said == "attitude\tattitude and thrust\nrates\tbody rates and thrust\n"


def test_what_may_be_switched_to():
    found = {one if isinstance(one, str) else one[0] for one in completion.switches("t=8:")}
    assert {"t=8:l1-off", "t=8:l1-on", "t=8:mpc-l1"} <= found
    assert completion.switches("") == ["t="]


def test_lists_kept_here_are_those_of_the_program():
    from companion.config.mocap_models import MocapConfig
    from companion.config.models import MissionConfig
    from companion.config.shapes import shape_of

    def choices(model, name):
        return set(shape_of(model.model_fields[name].annotation).choices)

    assert set(completion.PERTURBATIONS) == {"all", *PERTURBATIONS} - {NOMINAL}
    assert set(completion.AUTOPILOTS) == choices(MissionConfig, "autopilot")
    assert set(completion.SETPOINTS) == choices(MissionConfig, "setpoint")
    assert set(completion.MOCAP_SYSTEMS) == choices(MocapConfig, "system") - {"mock"}
    root = configs_folder().parent / "sitl_shim" / "sensors" / "profiles"
    assert set(completion.SENSORS) == {path.stem for path in root.glob("*.yaml")}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_each_shell_asks_the_program(shell, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "companion", "--show-completion", shell],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
    )
    assert "_COMPANION_COMPLETE=complete_" + shell in done.stdout


@pytest.mark.parametrize("words", [["fly", "--traj", ""], ["check", "--set", "hov"]])
def test_it_loads_nothing_that_flies(words, tmp_path):
    script = (
        "import sys\nfrom companion.cli import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        f"sys.stderr.write(' '.join(sorted(set({HEAVY!r}) & set(sys.modules))))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env={
            **os.environ,
            "_COMPANION_COMPLETE": "complete_bash",
            "COMP_WORDS": "\n".join(("companion", *words)),
            "COMP_CWORD": str(len(words)),
        },
    )
    assert done.stdout.split()
    assert done.stderr == ""
