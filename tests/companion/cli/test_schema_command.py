"""``companion schema``."""

import json

from typer.testing import CliRunner

from companion.cli import app
from companion.config.folders import schema_path
from tools.schemas import MODELS


def schema(*words):
    return CliRunner().invoke(app, ["schema", *words])


def test_it_lists_the_kinds_with_where_they_lie():
    lines = [line.split() for line in schema().stdout.splitlines()]
    assert lines == [[kind, str(schema_path(kind))] for kind in sorted(MODELS)]


def test_it_prints_a_schema_or_its_path():
    assert json.loads(schema("scenario").stdout)["title"].startswith("Scenario")
    assert schema("scenario", "--path").stdout == f"{schema_path('scenario')}\n"


def test_an_unknown_kind_is_bad_input():
    done = schema("rocket")
    assert done.exit_code == 2
    assert "Give one of: campaign, controller" in done.output
