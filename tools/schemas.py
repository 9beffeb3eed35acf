"""Write the JSON Schemas of all YAML files from the models that read them.

    python -m tools.schemas            # write configs/schemas/*.json
    python -m tools.schemas --check    # exit status 1 if one of them is not what the models say

The shim's models are not the companion's to import, so that `companion schema` shows these files.
"""

import argparse
import json
import sys
from pathlib import Path

from pydantic import BaseModel

from companion.config.json_schema import json_schema
from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.trajectory_models import TrajectoryConfig
from companion.experiments.campaigns.models import CampaignConfig
from companion.experiments.faults.table import FaultTable
from sitl_shim.faults.schema import Faults
from sitl_shim.sensors.profile import SensorProfile
from sitl_shim.wind.scenario import Scenario

FOLDER = Path(__file__).parent.parent / "configs" / "schemas"

MODELS: dict[str, type[BaseModel]] = {
    "mission": MissionConfig,
    "controller": ControllerConfig,
    "vehicle": VehicleConfig,
    "trajectory": TrajectoryConfig,
    "scenario": Scenario,
    "faults": Faults,
    "sensors": SensorProfile,
    "campaign": CampaignConfig,
    "fault-table": FaultTable,
}
"""The model of each kind of file."""
TITLES = {
    "mission": "Mission: a flight",
    "controller": "Controller: a stack with its gains",
    "vehicle": "Vehicle: what is known of it",
    "trajectory": "Trajectory: timed points",
    "scenario": "Scenario: wind, and what happens to the vehicle",
    "faults": "Faults: what goes wrong on purpose",
    "sensors": "Sensors: errors of the simulated estimate",
    "campaign": "Campaign: many flights over sampled parameters",
    "fault-table": "Table of faults, and how flights end with them",
}


def schema_text(kind: str) -> str:
    """What the file of a kind says."""
    schema = json_schema(MODELS[kind], TITLES[kind])
    return json.dumps(schema, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Write, or check; the exit status."""
    parser = argparse.ArgumentParser(description="JSON Schemas of the YAML files.")
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args(arguments).check
    FOLDER.mkdir(parents=True, exist_ok=True)
    stale = []
    for kind in MODELS:
        path, text = FOLDER / f"{kind}.json", schema_text(kind)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            stale.append(path.name)
            if not check:
                path.write_text(text, encoding="utf-8")
    print(f"{', '.join(stale) or 'nothing'} {'differs' if check else 'written'}")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
