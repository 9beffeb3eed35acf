"""docs/faults.md says what the files hold, and its examples are such files."""

from pathlib import Path

import pytest
import yaml

from sitl_shim.faults.schema import Bursts, LinkFault, load_faults

_ROOT = Path(__file__).parents[3]
_TEXT = (_ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
_BLOCKS = [block.split("```")[0] for block in _TEXT.split("```yaml\n")[1:]]


@pytest.mark.parametrize("block", [block for block in _BLOCKS if block.startswith("name:")])
def test_an_example_is_a_file_of_faults(block: str, tmp_path: Path) -> None:
    path = tmp_path / "example.yaml"
    path.write_text(block, encoding="utf-8")
    faults = load_faults(path)
    assert faults.link or faults.vehicle or faults.parameters


def test_the_example_of_a_mission_holds_faults() -> None:
    (mission,) = [yaml.safe_load(block) for block in _BLOCKS if "trajectory:" in block]
    faults = load_faults(yaml.safe_dump(mission["faults"], default_flow_style=True))
    assert faults.link[0].loss == 0.1


def test_every_key_of_a_link_is_told_with_its_default() -> None:
    rows = {
        row.split("|")[1].strip(): row.split("|")[2].strip()
        for row in _TEXT.splitlines()
        if row.startswith("| `")
    }
    told = {key.strip(" `"): default for cell, default in rows.items() for key in cell.split(",")}
    for key, field in LinkFault.model_fields.items():
        if key in ("from_s", "until_s", "reorder_by_s"):
            assert f"`{key}`" in _TEXT
            continue
        said = told[key].strip("`").replace(" ", "")
        if isinstance(field.default, float):
            assert float(said) == field.default
        else:
            assert said == ("none" if field.default is None else str(field.default).lower())
    assert all(f"`{key}`" in _TEXT for key in Bursts.model_fields)


def test_the_command_line_example_is_one() -> None:
    (text,) = [line.split("'")[1] for line in _TEXT.splitlines() if "'{" in line]
    assert load_faults(text).link[0].way == "setpoints"
