from pathlib import Path

import pytest
import yaml

from companion.config.resolve import shipped_names
from companion.config.yaml_source import ConfigError
from companion.experiments.batched.task import check_batch
from companion.experiments.campaigns.batches import batch_task_of
from companion.experiments.campaigns.plan import Parameter, load_plan
from companion.experiments.campaigns.tasks import checked_tasks, task_of

BASE = """\
name: tried
base: {trajectory: 4}
sample: {method: grid}
parameters:
  wind: [calm, fan]
"""


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "tried.yaml"
        path.write_text(text)
        return str(path)

    return write


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("wind: [calm, fan]", "winds: [calm]"), "line 5: there is no parameter 'winds'"),
        (("wind: [calm, fan]", "plant.weight: [1.0]"), "line 5: there is no 'plant.weight'"),
        (("wind: [calm, fan]", "plant.mass: [-1]"), "line 5: -1 is no factor on the mass"),
        (("wind: [calm, fan]", "plant.mass: [heavy]"), "line 5: a number is expected"),
        (("wind: [calm, fan]", "plant.mass: {low: 1, high: 2}"), "Add steps"),
        (("wind: [calm, fan]", "plant.mass: {low: 2, high: 1}"), "a range needs low < high"),
        (("wind: [calm, fan]", "plant.mass: {low: 2}"), "a range needs low < high"),
        (("wind: [calm, fan]", "plant.drag: {low: 0, high: 1, log: true}"), "above 0"),
        (("wind: [calm, fan]", "wind: {low: 1, high: 2, steps: 2}"), "needs a list of choices"),
        (("wind: [calm, fan]", "seed: {low: 1, high: 4, steps: 2}"), "Add integer: true"),
        (("wind: [calm, fan]", "seed: [1.5]"), "a seed is a whole number"),
        (("wind: [calm, fan]", "connect: [x]"), "no place in a study of simulated flights"),
        (("wind: [calm, fan]", "wind: []"), "line 5"),
        (("method: grid", "method: grid, points: 4"), "line 3: 'sample': a grid has as many"),
        (("method: grid", "method: sobol"), "Add points"),
        (("method: grid", "method: lattice"), "line 3: 'sample.method'"),
        (("name: tried", "nam: tried"), "Did you mean 'name'"),
        (("name: tried", "name: a/b"), "line 1: 'name'"),
        (("base: {", "each: {wind: [gusts]}\nbase: {"), "line 2: 'wind' varies by `parameters`"),
        (("base: {", "seeds: 2\nbase: {seeds: 3, "), "unknown key 'base.seeds'"),
        (("base: {", "base: {settings: {wnd: 1}, "), "line 2: there is no parameter 'wnd'"),
        (
            (
                "wind: [calm, fan]",
                (
                    "plant.mass: {low: 1, high: 2, steps: 2000}\n"
                    "  plant.drag: {low: 1, high: 2, steps: 2000}"
                ),
            ),
            "the grid has 4000000 points",
        ),
    ],
)
def test_what_can_not_be_flown_is_refused_with_file_line_and_remedy(written, change, said):
    path = written(BASE.replace(*change))

    with pytest.raises(ConfigError) as refused:
        load_plan(path)

    assert said in str(refused.value)
    assert path in str(refused.value)


def test_a_point_that_can_not_be_flown_is_named_before_anything_is_flown(written, tmp_path):
    text = BASE.replace("wind: [calm, fan]", "controller.mpc.horizon: [30, 1]")

    with pytest.raises(ConfigError, match=r"point 1 \(controller.mpc.horizon 1\) can't be flown"):
        checked_tasks(load_plan(written(text)), tmp_path)


@pytest.mark.parametrize(
    ("change", "line", "said"),
    [
        ("controller.mpc.horizon: {low: 20, high: 30, steps: 4}", 5, "Add integer: true"),
        ("controller.mpc.horizn: [30]", 5, "Did you mean 'horizon'"),
        ("seed: [1]\n  controller: [mpc-l1, none-such]", 6, "none-such"),
        ("seed: [1]\neach:\n  hover_s: [1, x]", 7, "valid number"),
    ],
)
def test_the_line_of_what_can_not_be_flown_is_told(written, tmp_path, change, line, said):
    path = written(BASE.replace("wind: [calm, fan]", change))

    with pytest.raises(ConfigError) as refused:
        checked_tasks(load_plan(path), tmp_path)

    assert str(refused.value).startswith(f"{path}, line {line}: point ")
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("wind: [calm, fan]", "wind: [calm, [1, 2]]"),
            "line 5: 'parameters.wind.values.1': a name, a number, true or false, or keys with",
        ),
        (("wind: [calm, fan]", "wind: [2026-01-01]"), "line 5: 'parameters.wind.values.0': a name"),
        (("name: tried", "name: größe"), "line 1: 'name': letters (a to z), digits"),
        (("4}", "4, settings: {hover_s: 2026-01-01}}"), "'base.settings.hover_s': a name, a nu"),
    ],
)
def test_a_value_of_no_kind_is_told_in_one_line(written, change, said):
    with pytest.raises(ConfigError) as refused:
        load_plan(written(BASE.replace(*change)))

    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_unknown_name_lists_the_shipped_campaigns():
    with pytest.raises(ConfigError, match="brief, grid, map, robustness"):
        load_plan("no-such")


def test_each_point_is_flown_with_each_of_each_and_every_seed(written):
    plan = load_plan(written(BASE + "each: {controller: [mpc-l1, lqr-l1]}\nseeds: 2\n"))

    assert [flight.point for flight in plan.flights] == list(range(8))
    assert [tuple(flight.values.values()) for flight in plan.flights[:5]] == [
        ("calm", "mpc-l1", 1),
        ("calm", "mpc-l1", 2),
        ("calm", "lqr-l1", 1),
        ("calm", "lqr-l1", 2),
        ("fan", "mpc-l1", 1),
    ]
    assert plan.parameters == (
        Parameter("wind", "choice", values=("calm", "fan"), nominal="calm"),
        Parameter("controller", "choice", values=("mpc-l1", "lqr-l1"), nominal="mpc-l1"),
        Parameter("seed", "number", low=1.0, high=2.0, values=(1.0, 2.0), nominal=1.0),
    )


def test_a_points_values_reach_its_task_and_its_plant(written, tmp_path):
    text = BASE.replace(
        "wind: [calm, fan]",
        "plant.mass: [1.5]\n  plant.delay_s: [0.02]\n  autopilot: [ardupilot]\n"
        "  controller.mpc.horizon: [25]\n  trajectory: [2]\n  seed: [7]\n"
        "  faults: [none, {link: [{loss: 0.1}]}]",
    )
    plan = load_plan(written(text))

    clean, faulty = (task_of(plan, flight, tmp_path) for flight in plan.flights)

    assert (clean.trajectory, clean.seed, clean.faults) == (2, 7, None)
    assert yaml.safe_load(faulty.faults) == {"link": [{"loss": 0.1}]}
    assert dict(clean.settings) == {"autopilot": "ardupilot", "controller.mpc.horizon": "25"}
    plant = yaml.safe_load(Path(clean.shim_vehicle).read_text())
    assert plant["mass_kg"] == pytest.approx(0.75)
    assert plant["telemetry_delay_s"] == pytest.approx(0.025)
    assert clean.shim_vehicle == faulty.shim_vehicle


def test_a_nominal_vehicle_is_the_shipped_one(written, tmp_path):
    text = BASE.replace("wind: [calm, fan]", "plant.mass: [1.0]\n  plant.delay_s: [0]")
    plan = load_plan(written(text))

    assert task_of(plan, plan.flights[0], tmp_path).shim_vehicle is None


def test_files_are_relative_to_the_campaigns_folder(written, tmp_path):
    (tmp_path / "mine.yaml").write_text("points: [[0, 0, 0, 1], [1, 0, 0, 1]]\n")
    plan = load_plan(written(BASE.replace("trajectory: 4", "trajectory: mine.yaml")))

    assert plan.config.base.trajectory == str(tmp_path / "mine.yaml")


def test_a_plan_is_known_by_what_it_flies_and_not_by_how_the_file_is_written(written):
    digest = load_plan(written(BASE)).digest

    assert load_plan(written("# A remark.\nsays: hello\n" + BASE)).digest == digest
    assert load_plan(written(BASE.replace("calm, fan", "fan, calm"))).digest != digest
    assert load_plan(written(BASE.replace("trajectory: 4", "trajectory: 3"))).digest != digest


def test_the_documentations_example_can_be_flown(written, tmp_path):
    text = (Path(__file__).parents[4] / "docs" / "campaigns.md").read_text()
    example = text.partition("```yaml\n")[2].partition("```")[0]

    tasks = checked_tasks(load_plan(written(example)), tmp_path)

    assert len(tasks) == 160
    assert f"That is {len(tasks)} flights" in text


@pytest.mark.parametrize("name", shipped_names("campaign"))
def test_every_shipped_campaign_can_be_flown(name, tmp_path):
    plan = load_plan(name)

    assert plan.remarks == ()
    some = plan.flights[:: max(1, len(plan.flights) // 20)]
    if plan.config.engine == "batched":
        check_batch([batch_task_of(plan, flight) for flight in some])
    assert len({task_of(plan, flight, tmp_path).key for flight in some}) == len(some)
