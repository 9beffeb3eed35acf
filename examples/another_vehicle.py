"""Another vehicle: a bebop2 with a heavier frame.

What a vehicle *is* stands in its plant file, which only the simulator reads; what the companion
*knows* of it stands in its vehicle file.  Run it with `python another_vehicle.py`; it writes
heavy-plant.yaml and heavy.yaml, which `companion fly` takes too.
"""

from companion.api import fly, plant_of, vehicle_of, write_yaml


def main() -> None:
    """Make the two files, and fly the vehicle that they describe beside the bebop2."""
    plant = plant_of("bebop2")
    plant["name"] = "heavy"
    plant["mass_kg"] *= 1.3
    plant["inertia_kg_m2"] = [1.4 * inertia for inertia in plant["inertia_kg_m2"]]
    plant["drag"]["linear_n_s_m"] = [0.1, 0.1, 0.1]
    plant_file = write_yaml("heavy-plant.yaml", plant)

    vehicle = vehicle_of("bebop2")  # its name stays: the gains are those for the bebop2
    vehicle["source"] = "a scale, and the thrust of a hover"
    vehicle["hover_thrust"] = 0.64
    vehicle["acceleration_limit_m_s2"] = 3.5
    vehicle_file = write_yaml("heavy.yaml", vehicle)

    for flight in (
        fly(trajectory=4, vehicle="bebop2", wind="fan", seed=1),
        fly(trajectory=4, vehicle=vehicle_file, plant=plant_file, wind="fan", seed=1),
    ):
        tracked = flight.ticks.track_s > 0.0
        print(
            f"{flight.vehicle}: {flight.outcome}, mean error {1e3 * flight.mean_error_m:.1f} mm, "
            f"hovers at {flight.ticks.hover_thrust[tracked].mean():.2f} of its thrust"
        )


if __name__ == "__main__":
    main()
