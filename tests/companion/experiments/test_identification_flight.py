"""Where an identification flight may fly: its box, within the geofence that a mission states."""

import pytest

from companion.config.yaml_source import ConfigError
from companion.experiments.identification_flight import load_identification, plan_identification


def fence_of(*, box_m=2.5, height_m=2.5, **settings):
    dotted = {key.replace("__", "."): value for key, value in settings.items()}
    config = load_identification(None, {"vehicle": "x500"}, dotted)
    mission = plan_identification(config, box_m=box_m, height_m=height_m).config.mission
    return mission.geofence.low_m, mission.geofence.high_m


def test_without_a_stated_geofence_the_fence_follows_the_box():
    low, high = fence_of(box_m=5.0)
    assert low == (-5.0, -5.0, 0.2)
    assert high == pytest.approx((5.0, 5.0, 5.7))


def test_a_stated_geofence_is_never_left_for_the_box():
    low, high = fence_of(geofence__low_m="[-3, -4, 1.0]", geofence__high_m="[3, 4, 4.2]")
    assert low == (-2.5, -2.5, 1.0)
    assert high == (2.5, 2.5, 4.2)


def test_a_wide_geofence_leaves_the_box_as_it_is():
    wide = {"geofence__low_m": "[-30, -30, 0]", "geofence__high_m": "[30, 30, 30]"}
    assert fence_of(**wide) == fence_of()


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        ("[-1.55, -3, 0.2]", "[3, 3, 6]", "--box 1.5 fits"),
        ("[-3, -3, 0.2]", "[3, 2.4, 6]", "--box 2.4 fits"),
        ("[-1, -3, 0.2]", "[3, 3, 6]", "No box fits"),
        ("[1, -3, 0.2]", "[3, 3, 6]", "No box fits"),
        ("[-3, -3, 0.2]", "[3, 3, 3.2]", "--height 2 fits"),
        ("[-3, -3, 1.8]", "[3, 3, 6]", "--height 3 fits"),
        ("[-3, -3, 0.2]", "[3, 3, 2.0]", "--height 1.2 fits"),
        ("[-3, -3, 1.8]", "[3, 3, 3.2]", "No height fits"),
    ],
)
def test_a_box_that_reaches_out_of_a_stated_geofence_is_refused_with_one_that_does_not(
    low, high, said
):
    with pytest.raises(ConfigError, match="geofence") as refused:
        fence_of(geofence__low_m=low, geofence__high_m=high)
    assert said in str(refused.value)


def test_the_box_and_the_height_that_are_named_do_fit():
    stated = {"geofence__low_m": "[-1.55, -3, 0.2]", "geofence__high_m": "[3, 3, 2.0]"}
    low, high = fence_of(box_m=1.5, height_m=1.2, **stated)
    assert low == (-1.5, -1.5, 0.2)
    assert high == (1.5, 1.5, 2.0)


def test_a_geofence_about_the_local_frames_origin_is_refused():
    with pytest.raises(ConfigError, match=r"--set origin\.at=takeoff"):
        fence_of(geofence__high_m="[3, 3, 6]", origin__at="local")


@pytest.mark.parametrize("height_m", [float("inf"), float("nan"), 20.1, 1e9])
def test_a_height_that_is_none_is_refused(height_m):
    with pytest.raises(ConfigError, match=r"--height: a hover at .* only at 1\.1 to 20 m"):
        fence_of(height_m=height_m)


@pytest.mark.parametrize("box_m", [float("inf"), float("nan"), 0.0, 11.0])
def test_a_box_that_is_none_is_refused(box_m):
    with pytest.raises(ConfigError, match="is not flown in"):
        fence_of(box_m=box_m)
