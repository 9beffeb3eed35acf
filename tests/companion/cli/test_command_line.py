"""The program as it is started."""

import os
import subprocess
import sys

import pytest


def companion(*arguments, cwd, **environment):
    return subprocess.run(
        [sys.executable, "-m", "companion", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=60,
        check=False,
        env=os.environ | environment,
    )


def test_version(tmp_path):
    from importlib.metadata import version

    done = companion("--version", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"companion {version('companion')}\n")


def test_help_names_the_commands(tmp_path):
    done = companion("--help", cwd=tmp_path)
    assert done.returncode == 0
    assert {"fly", "land", "abort", "resume"} <= set(done.stdout.split())


def test_help_loads_nothing_that_flies(tmp_path):
    script = (
        "import sys\nfrom companion.cli import app\n"
        "try:\n    app(['--help'], prog_name='companion')\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'yaml', 'osqp', 'scipy', 'matplotlib', 'pymavlink'}\n"
        "sys.stderr.write(' '.join(sorted(heavy & set(sys.modules))))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stderr == ""


@pytest.mark.parametrize("arguments", [("soar",), ("--fast",), ("fly", "--set", "hover=2")])
def test_bad_input_ends_with_2_and_one_message(arguments, tmp_path):
    done = companion(*arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "rror: " in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["land", "abort", "resume"])
def test_a_word_to_a_flight_that_is_not_there(command, tmp_path):
    done = companion(command, "--pid", "4194304", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")


def test_what_the_shim_refuses_is_bad_input_over_udp_too(tmp_path):
    (tmp_path / "s.yaml").write_text("name: x\nwinds: [{kind: storm}]\n")

    done = companion("fly", "--wind", "s.yaml", "--out", "flight", cwd=tmp_path)

    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: scenario file ")
    assert "line 2: 'winds.0'" in done.stderr
    assert not (tmp_path / "flight").exists()


def test_what_ascii_can_not_say_ends_nothing(tmp_path):
    arguments = ("--traj", "2", "--lockstep", "--set", "vehicle.acceleration_limit_m_s2=0.5")

    done = companion("fly", *arguments, cwd=tmp_path, PYTHONIOENCODING="ascii")

    assert done.returncode == 3
    assert "limit is 0.5 m/s?." in done.stderr
    assert len(done.stderr.splitlines()) == 1
