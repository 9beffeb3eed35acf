"""JSON Schemas of YAML files from their models, as editors complete, check and explain by them.

Draft 7, which is what editors' YAML servers know best.  A schema never refuses a file that its
model takes; what the model refuses beyond it (keys that do not go together, say) is told when the
file is read.
"""

import math
from typing import Any

from pydantic import BaseModel

from companion.config.describe import default_text, models_in, section_text, text_of, unit_of_field
from companion.config.shapes import shape_of
from companion.config.units import TYPE_KEY, UNIT_KEY

_DRAFT = "http://json-schema.org/draft-07/schema#"
_DROPPED = ("title", "discriminator", UNIT_KEY, TYPE_KEY)


def json_schema(model: type[BaseModel], title: str) -> dict[str, Any]:
    """The JSON Schema of a file.

    Args:
        model: of the whole file.
        title: what an editor calls the file.

    Returns:
        The schema, ready for `json.dumps`; the same for the same model.
    """
    made = model.model_json_schema()
    models = models_in(model)
    sections = made.pop("$defs", {})
    for name, section in sections.items():
        _explain(section, models[name])
    _explain(made, model)
    body = {key: _plain(value) for key, value in made.items() if key not in _DROPPED}
    schema = {"$schema": _DRAFT, "title": title, **body}
    if sections:
        schema["$defs"] = {name: _plain(sections[name]) for name in sorted(sections)}
    return schema


def hover_text(model: type[BaseModel], name: str) -> str:
    """What an editor says of a key: its meaning, unit, limits and default.

    >>> from companion.config.models import MissionConfig
    >>> hover_text(MissionConfig, "takeoff_height_m").endswith("(m; 0.5 … 20; default: 2.5)")
    True
    """
    field = model.model_fields[name]
    shape = shape_of(field.annotation, tuple(field.metadata))
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    default = default_text(field)
    facts = (
        str(extra.get(TYPE_KEY, "")),
        unit_of_field(name, field),
        "" if TYPE_KEY in extra else shape.limits,
        f"default: {default}" if default else "",
    )
    told = "; ".join(fact for fact in facts if fact)
    return " ".join(part for part in (text_of(model, name), f"({told})" if told else "") if part)


def _explain(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Put the models' own words into the schema of one of them, in place."""
    schema["description"] = section_text(model)
    for place in (schema, *schema.get("anyOf", ())):
        for name, value in place.get("properties", {}).items():
            value["description"] = hover_text(model, name)
            default = value.get("default")
            endless = isinstance(default, float) and not math.isfinite(default)
            if isinstance(default, dict) or endless:
                del value["default"]


def _plain(value: Any) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """Without pydantic's titles, and lists of a fixed length as draft 7 has them."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if not isinstance(value, dict):
        return value
    if "prefixItems" in value:
        value = _fixed_list(value)
    kept: dict[str, Any] = {}
    for key, item in value.items():
        if key == "properties":
            kept[key] = {name: _plain(of_key) for name, of_key in item.items()}
        elif key not in _DROPPED:
            kept[key] = _plain(item)
    return kept


def _fixed_list(value: dict[str, Any]) -> dict[str, Any]:
    items = value["prefixItems"]
    same = all(item == items[0] for item in items)
    rest = {key: item for key, item in value.items() if key != "prefixItems"}
    return {**rest, "items": items[0] if same else items}
