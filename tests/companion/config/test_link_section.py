import pytest

from companion.config.resolve import load_flight
from companion.config.yaml_source import ConfigError


def link_of(**settings):
    keys = {f"link.{key}": value for key, value in settings.items()}
    return load_flight(None, {}, keys).mission.link


def test_by_default_nobody_shares_the_link_and_the_first_vehicle_is_flown():
    link = link_of()

    assert link.forward == ()
    assert (link.system_id, link.component_id, link.mission_backend) == (None, None, "companion")


def test_endpoints_are_filtered_and_local_unless_it_is_said():
    (endpoint,) = link_of(forward="[{url: 'udpin://127.0.0.1:14600'}]").forward

    assert endpoint.url == "udpin://127.0.0.1:14600"
    assert not any(
        (endpoint.remote, endpoint.allow_setpoints, endpoint.allow_commands, endpoint.truth)
    )


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("system_id", "0", "link.system_id"),
        ("system_id", "256", "link.system_id"),
        ("component_id", "0", "link.component_id"),
        ("mission_backend", "mavros", "link.mission_backend"),
        ("forward", "[{allow_commands: true}]", "url"),
        ("forward", "[{url: 'udpin://127.0.0.1:1', allow_command: true}]", "allow_command"),
        ("forward", "[{url: 'udpin://127.0.0.1:1', remote: 'yes'}]", "remote"),
    ],
)
def test_what_is_wrong_is_named(key, value, named):
    with pytest.raises(ConfigError, match=named):
        link_of(**{key: value})
