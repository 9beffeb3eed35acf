"""What is told of a missing extra can be typed as it stands, wherever the program is installed."""

import sys
from pathlib import Path

import pytest

from companion import extras


@pytest.fixture
def program(monkeypatch, tmp_path):
    """An environment of the program's own: its Python, and what else is there."""
    there = tmp_path / "an environment" / "bin"
    there.mkdir(parents=True)
    monkeypatch.setattr(sys, "executable", str(there / "python"))
    monkeypatch.setenv("PATH", "/nowhere")
    return there


def put_pip(folder: Path) -> None:
    pip = folder / "pip"
    pip.write_text("#!/bin/sh\n")
    pip.chmod(0o755)


def test_in_an_active_environment_it_is_plain_pip(program, monkeypatch) -> None:
    put_pip(program)
    monkeypatch.setenv("PATH", str(program))
    assert extras.install_extra("live") == "pip install 'companion[live]'"


def test_another_environments_pip_is_not_named(program, monkeypatch, tmp_path) -> None:
    put_pip(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert extras.install_extra("live") == (f"'{program}/python' -m pip install 'companion[live]'")


def test_without_pip_it_is_uv_that_installs(program, monkeypatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None)
    assert extras.install_extra("live") == (
        f"uv pip install --python '{program}/python' 'companion[live]'"
    )
