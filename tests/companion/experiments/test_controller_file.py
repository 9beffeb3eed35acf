import pytest

from companion.config.models import ControllerConfig
from companion.config.resolve import configs_folder
from companion.config.validation import validate
from companion.config.yaml_source import parse_yaml, read_yaml
from companion.experiments.controller_file import controller_yaml, write_whole

SHIPPED = sorted((configs_folder() / "controllers").glob("*/*.yaml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_shipped_controller_is_read_back_as_it_was(path):
    data = read_yaml(path).data

    text = controller_yaml("A remark.", data)

    again = parse_yaml(text, "again")
    assert again.data == {**data, "source": data["source"].strip()}
    validate(ControllerConfig, again)
    assert text.startswith("# A remark.\nframework: ")
    assert max(map(len, text.splitlines())) <= 100


def test_awkward_numbers_and_words_survive():
    data = {
        "source": "mean → 1 mm; from: here # and there",
        "a": {"small": 1e-05, "large": 1e22, "whole": 3, "flag": True, "text": "no", "none": None},
        "b": {"list": [{"numerator": [1.0], "denominator": [1.0, 0.5]}, 0.0]},
        "c": None,
    }

    again = parse_yaml(controller_yaml("r", data), "again").data

    assert again["source"] == data["source"]
    assert again["a"] == {"small": 1e-05, "large": 1e22, "whole": 3, "flag": True, "text": "no"}
    assert again["b"] == data["b"]
    assert "c" not in again


def test_a_file_is_written_whole_and_nothing_is_left_beside_it(tmp_path):
    path = tmp_path / "new" / "a.yaml"
    write_whole(path, "first\n")
    write_whole(path, "second\n")

    assert path.read_text() == "second\n"
    assert list(path.parent.iterdir()) == [path]
