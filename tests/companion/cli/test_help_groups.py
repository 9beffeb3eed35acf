"""Helps: grouped, in 80 columns, with examples that the command line takes."""

import re
import shlex
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from companion.cli import COMMANDS, app
from companion.cli.common import wrapped
from companion.cli.examples import ABOUT

ROOT = Path(__file__).parents[3]
GROUP = typer.main.get_command(app)
NAMES = [command.__name__ for command in COMMANDS]
EXAMPLES = [example for name, about in ABOUT.items() if name in NAMES for example in about.examples]


def helped(*words, columns=80):
    # Two columns stay free, as on a terminal.
    done = CliRunner().invoke(app, [*words, "--help"], terminal_width=columns - 2)
    assert done.exit_code == 0
    return done.stdout


def test_every_command_is_listed_once_in_one_line_under_its_group():
    text = helped()
    for name in NAMES:
        rows = re.findall(rf"^  {name} +(.+)$", text, re.MULTILINE)
        assert rows == [ABOUT[name].short], name
    heads = re.findall(r"^(\S.*):$", text, re.MULTILINE)
    assert heads == ["Options", *dict.fromkeys(about.panel for n, about in ABOUT.items()
                                               if n in NAMES)]  # fmt: skip


@pytest.mark.parametrize("columns", [60, 80])
@pytest.mark.parametrize("name", ["", *NAMES])
def test_a_help_fits_its_terminal(name, columns):
    lines = helped(*([name] if name else []), columns=columns).splitlines()
    shown = [line for line in lines if not line.startswith("    companion ")]
    assert max(map(len, shown)) <= columns


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_is_taken_as_it_stands(example):
    program, name, *words = shlex.split(example.partition(" > ")[0])
    assert program == "companion"
    command = GROUP.commands[name]
    context = command.make_context(name, words)  # reads it, runs nothing
    assert context.params
    assert len(f"    {example}") <= 80


@pytest.mark.parametrize("name", NAMES)
def test_a_help_ends_with_examples_and_where_to_read_on(name):
    text = helped(name)
    assert "Examples:" in text
    documents = re.findall(r"(?:docs/)?[\w-]+\.md", text.partition("Read next: ")[2])
    assert documents
    assert all((ROOT / one).is_file() for one in documents)


def test_an_error_on_a_terminal_ends_its_lines_between_words():
    text = "error: first of two faults, which is told at length\nsecond: /a/path-that/is/longer"
    assert wrapped(text, 24).splitlines() == [
        "error: first of two",
        "  faults, which is told",
        "  at length",
        "second:",
        "  /a/path-that/is/longer",
    ]
