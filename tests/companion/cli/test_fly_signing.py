"""Which key a flight gets, from the command line, the mission and the environment."""

import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.config.signing_key import KEY_VARIABLE

KEY, OTHER, THIRD = (bytes(range(start, start + 32)) for start in (0, 100, 200))


class ReachedError(Exception):
    """The flight would begin now."""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(KEY_VARIABLE, raising=False)
    return tmp_path


@pytest.fixture
def keys(monkeypatch):
    """Keys (ours, the embedded shim's) of each flight that would have begun."""
    given = []

    def fly(config, trajectory, log, observer, shim, *, signing_key):
        given.append((signing_key, shim.signing_key if shim else None))
        raise ReachedError

    monkeypatch.setattr("companion.lockstep.fly_in_lockstep", fly)
    monkeypatch.setattr("companion.flight.real_time.fly_in_real_time", fly)
    return given


def key_file(folder, key, name="signing.key", mode=0o600):
    path = folder / name
    path.write_bytes(key)
    path.chmod(mode)
    return path


def mission(folder, text):
    path = folder / "mission.yaml"
    path.write_text(text)
    return f"--mission={path}"


def run(*arguments, out="out"):
    return CliRunner().invoke(app, ["fly", f"--out={out}", *arguments])


@pytest.mark.parametrize("how", ["--lockstep", "--verbose"])
def test_companion_and_embedded_shim_get_the_key_of_a_file(how, here, keys):
    run(how, f"--signing-key-file={key_file(here, KEY)}")

    assert keys == [(KEY, KEY)]


def test_a_real_vehicle_has_its_own(here, keys):
    run("--connect=udpin://127.0.0.1:0", f"--signing-key-file={key_file(here, KEY)}")

    assert keys == [(KEY, None)]


def test_without_a_key_nothing_is_signed(keys):
    run("--lockstep")

    assert keys == [(None, None)]


def test_the_command_line_wins_over_the_mission_and_that_over_the_environment(
    here, keys, monkeypatch
):
    folder = here / "missions"
    folder.mkdir()
    key_file(folder, OTHER)
    file = mission(folder, "link: {signing: {key_file: signing.key}}\n")
    monkeypatch.setenv(KEY_VARIABLE, THIRD.hex())

    run("--lockstep", out="1")
    run("--lockstep", file, out="2")
    run("--lockstep", file, f"--signing-key-file={key_file(here, KEY)}", out="3")

    assert [ours for ours, _ in keys] == [THIRD, OTHER, KEY]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("link: {signing: {}}\n", "link.signing asks for signed packets, and there is no key"),
        ("link: {signing: {key_file: none.key}}\n", "none.key: the signing key can't be read"),
        ("link: {signing: {key: 00}}\n", "unknown key 'link.signing.key'. Did you mean 'key_file'"),
        ("link: {signing: {link_id: 256}}\n", "'link.signing.link_id'"),
    ],
)
def test_a_mission_without_its_key_is_refused(text, says, here, keys):
    result = run("--lockstep", mission(here, text))

    assert result.exit_code == 2
    assert says in " ".join(result.stderr.split())
    assert keys == []


def test_a_key_that_others_can_read_is_refused_with_the_remedy(here, keys):
    path = key_file(here, KEY, mode=0o644)

    result = run("--lockstep", f"--signing-key-file={path}")

    assert result.exit_code == 2
    assert f"chmod 600 {path}" in " ".join(result.stderr.split())
    assert keys == []
    assert not (here / "out").exists()


def test_there_is_no_option_for_the_key_itself(here, keys):
    for option in ("--signing-key", "--key"):
        assert run("--lockstep", option, KEY.hex()).exit_code == 2
    assert keys == []
