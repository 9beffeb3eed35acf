import pytest
import yaml

from companion.config.resolve import shipped_names
from companion.config.yaml_source import ConfigError
from companion.experiments.perturbations import NOMINAL, PERTURBATIONS, chosen, perturbed_plant
from sitl_shim.plant.vehicle import load_vehicle


def names(*texts):
    return [perturbation.name for perturbation in chosen(texts)]


def test_the_nominal_vehicle_is_always_flown_and_first():
    assert names() == [NOMINAL]
    assert names("lag+50", "mass-20") == [NOMINAL, "mass-20", "lag+50"]


def test_names_may_be_joined_repeated_and_written_with_a_times_sign():
    assert names("drag×2,loss10", "loss10") == [NOMINAL, "dragx2", "loss10"]
    assert names("all") == names("combo", "all") == list(PERTURBATIONS)


def test_an_unknown_one_is_refused_with_those_that_there_are():
    with pytest.raises(ConfigError, match=r"--perturb lag\+10: .*lag\+25, lag-25"):
        chosen(("lag+10",))


@pytest.mark.parametrize("vehicle", shipped_names("vehicle"))
@pytest.mark.parametrize("name", PERTURBATIONS)
def test_the_shim_reads_each_ones_plant_and_it_is_not_the_shipped_one(vehicle, name, tmp_path):
    perturbation = PERTURBATIONS[name]
    path = perturbed_plant(vehicle, perturbation, tmp_path)
    if not perturbation.changes:
        assert path is None
        return
    assert load_vehicle(path) != load_vehicle(vehicle)
    assert load_vehicle(path).name == vehicle


def test_a_plant_is_changed_where_it_is_said_and_nowhere_else(tmp_path):
    path = perturbed_plant("bebop2", PERTURBATIONS["mass+20"], tmp_path)
    changed, shipped = load_vehicle(path), load_vehicle("bebop2")
    assert changed.mass_kg == pytest.approx(1.2 * shipped.mass_kg)
    assert changed.model_copy(update={"mass_kg": shipped.mass_kg}) == shipped


def test_the_same_perturbation_writes_the_same_bytes(tmp_path):
    written = [
        perturbed_plant("x500", PERTURBATIONS["combo"], tmp_path / name).read_bytes()
        for name in ("one", "two")
    ]
    assert written[0] == written[1]
    assert yaml.safe_load(written[0])["telemetry_delay_s"] == pytest.approx(0.014)


def test_a_vehicle_that_the_shim_has_not_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no vehicle kite"):
        perturbed_plant("kite", PERTURBATIONS["mass+20"], tmp_path)
