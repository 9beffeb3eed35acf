from pathlib import Path

from sitl_shim.wind import load_scenario

DOCS = Path(__file__).parents[2] / "docs" / "scenarios.md"


def test_the_scenario_in_the_docs_is_one(tmp_path):
    path = tmp_path / "bad-day.yaml"
    path.write_text(DOCS.read_text(encoding="utf-8").split("```yaml\n")[1].split("```")[0])
    scenario = load_scenario(path)
    assert (scenario.name, len(scenario.winds)) == ("bad-day", 2)
    assert [load.mass_on(2.0) for load in scenario.payload] == [0.3, 0.0]
    assert scenario.motors[0].since == "setpoints"


def test_the_docs_name_every_shipped_scenario():
    text = DOCS.read_text(encoding="utf-8")
    shipped = (DOCS.parents[1] / "configs" / "scenarios").glob("*.yaml")
    names = {path.stem for path in shipped if not path.stem.startswith("fan-")}
    assert all(f"`{name}`" in text for name in names), names
