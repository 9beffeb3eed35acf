import pytest
from typer.testing import CliRunner

from companion.cli import app


def run(*arguments):
    return CliRunner().invoke(app, ["mocap", *arguments])


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((), "--connect"),
        (("--connect", "udpin://127.0.0.1:0"), "--mocap SYSTEM"),
        (("--connect", "udpin://127.0.0.1:0", "--mocap", "kinect"), "mocap.system"),
        (("--connect", "nonsense://x", "--mocap", "udp"), "nonsense"),
        (
            ("--connect", "udpin://127.0.0.1:0", "--mocap", "udp", "--set", "mocap.rate_hz=500"),
            "rate",
        ),
    ],
)
def test_what_it_cannot_do_is_refused_with_the_remedy(arguments, named):
    result = run(*arguments)
    assert result.exit_code == 2
    assert named in result.output
