"""What YAML files may say, as read from the models."""

from typing import Annotated, Any, Literal

import pytest
from pydantic import BaseModel, Field

from companion.config.describe import describe, every_key, models_in, text_of, yaml_text
from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.shapes import shape_of
from companion.config.trajectory_models import TrajectoryConfig
from companion.config.units import unit, unit_of, written
from companion.experiments.campaigns.models import CampaignConfig
from sitl_shim.faults.schema import Faults
from sitl_shim.wind.scenario import Load, Scenario


class Inner(BaseModel):
    """An inner
    section."""

    length_m: Annotated[float, Field(gt=0.0)] = 1.0
    """How long, ``or``
    longer."""


class Outer(BaseModel):
    """A file."""

    count: Annotated[int, Field(ge=0, lt=10)]
    kind: Literal["a", "b"] = "a"
    gain: float = Field(default=2.0, description="A gain.", json_schema_extra=unit("1/s"))
    what: int | str = Field(default=1, json_schema_extra=written("1 … 5, or a name"))
    inner: Inner = Inner()
    perhaps: Inner | None = None
    several: tuple[Inner, ...] = ()
    named: dict[str, Inner] = Field(default_factory=dict)
    axes: tuple[float, float, float] = (0.0, 1.0, 2.0)


KEYS = {key.path: key for key in every_key(describe(Outer))}


def test_every_key_is_found_with_its_path():
    below = [f"{one}.length_m" for one in ("inner", "perhaps", "several[]", "named.*")]
    assert set(below) <= KEYS.keys()
    assert [key.name for key in describe(Outer).keys] == list(Outer.model_fields)


def test_a_key_says_type_unit_limits_default_and_meaning():
    count, gain, length = KEYS["count"], KEYS["gain"], KEYS["inner.length_m"]
    assert (count.type, count.limits, count.required, count.default) == (
        "whole number", "0 … 9", True, "",
    )  # fmt: skip
    assert (gain.unit, gain.default, gain.text) == ("1/s", "2.0", "A gain.")
    assert (length.unit, length.limits, length.text) == ("m", "> 0", "How long, `or` longer.")
    assert KEYS["kind"].choices == ("a", "b")
    assert KEYS["what"].type == "1 … 5, or a name"
    assert (KEYS["axes"].type, KEYS["axes"].default) == ("3 numbers", "[0.0, 1.0, 2.0]")


def test_a_section_is_told_by_what_it_is():
    assert KEYS["inner"].text == "An inner section."
    assert (KEYS["inner"].default, KEYS["perhaps"].default) == ("", "null")
    kinds = [KEYS[name].type for name in ("inner", "several", "named")]
    assert kinds == ["section", "list of sections", "sections by name"]
    assert set(models_in(Outer)) == {"Outer", "Inner"}


@pytest.mark.parametrize(
    ("annotation", "words"),
    [
        (tuple[str, ...], "list of texts"),
        (dict[str, Any], "keys with values"),
        (float | Literal["vehicle"], "number or vehicle"),
        (bool | None, "true or false"),
        (Any, "anything"),
    ],
)
def test_annotations_in_words(annotation, words):
    assert shape_of(annotation).words == words


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("natural_frequency_rad_s", "rad/s"),
        ("maximum_acceleration_m_s2", "m/s²"),
        ("acceleration_m_s2_sqrt_hz", "m/s² per √Hz"),
        ("linear_drag_1_s", "1/s"),
        ("hover_s", "s"),
        ("horizon", ""),
        ("m", ""),
    ],
)
def test_units_by_the_end_of_a_name(name, expected):
    assert unit_of(name) == expected


def test_values_as_yaml_keep_their_letters_and_their_order():
    assert yaml_text({"ω": 1.0, "a": (True, None)}) == "{ω: 1.0, a: [true, null]}"


@pytest.mark.parametrize(
    "model",
    [MissionConfig, ControllerConfig, VehicleConfig, CampaignConfig, TrajectoryConfig, Scenario,
     Faults],
)  # fmt: skip
def test_every_key_that_a_user_sets_says_what_it_is(model):
    silent = [key.path for key in every_key(describe(model)) if not key.text]
    assert silent == []


def test_docstrings_below_fields_are_read_of_bases_too():
    assert text_of(Load, "at_s") == "Simulated time."
