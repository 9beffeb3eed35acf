"""The configuration for "what would this controller have sent"."""

from companion.config.models import ControllerConfig
from companion.config.relief import ROBUST, with_reliefs
from companion.config.resolve import FlightConfig, configs_folder, controller_path
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml


def with_controller(config: FlightConfig, controller: str) -> FlightConfig:
    """A flight's configuration with another controller, and without planned hand-overs.

    Args:
        config: of the flight.
        controller: name or path, as `fly --controller` takes it.

    Raises:
        ConfigError: there is none for the vehicle, or it is wrong.
    """
    vehicle = config.vehicle.name

    def read(name: str) -> ControllerConfig:
        return validate(ControllerConfig, read_yaml(controller_path(name, vehicle)))

    mission = config.mission.model_copy(update={"controller": controller, "switch": ()})
    shipped = configs_folder() / "controllers" / ROBUST / f"{vehicle}.yaml"
    made, others = with_reliefs(mission, read(controller), read, robust=shipped.is_file())
    return FlightConfig(mission, config.vehicle, made, others)
