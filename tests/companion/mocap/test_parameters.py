import pytest

from companion.mocap.parameters import misfits, parameter_names

PX4 = {"EKF2_EV_CTRL": 15.0, "EKF2_GPS_CTRL": 0.0, "EKF2_HGT_REF": 3.0}
ARDUPILOT = {
    "VISO_TYPE": 1.0,
    "EK3_SRC1_POSXY": 6.0,
    "EK3_SRC1_POSZ": 6.0,
    "EK3_SRC1_YAW": 6.0,
    "EK3_SRC1_VELXY": 0.0,
    "EK3_SRC1_VELZ": 0.0,
}


@pytest.mark.parametrize(("autopilot", "values"), [("px4", PX4), ("ardupilot", ARDUPILOT)])
def test_what_is_set_for_motion_capture_fits(autopilot, values):
    assert set(parameter_names(autopilot)) == set(values)
    assert misfits(autopilot, values) == ()


@pytest.mark.parametrize(("autopilot", "values"), [("px4", PX4), ("ardupilot", ARDUPILOT)])
def test_each_that_does_not_fit_is_named_with_what_is_wanted(autopilot, values):
    for name, wanted in values.items():
        (found,) = misfits(autopilot, values | {name: wanted + 2.0 if wanted < 3 else 1.0})
        assert (found.name, found.wanted) == (name, wanted)
        assert found.why


def test_fusing_the_velocity_does_not_matter_as_none_is_sent():
    assert misfits("px4", PX4 | {"EKF2_EV_CTRL": 11.0}) == ()


def test_one_that_the_autopilot_does_not_have_is_named_too():
    (found,) = misfits("px4", {k: v for k, v in PX4.items() if k != "EKF2_EV_CTRL"})
    assert (found.name, found.value) == ("EKF2_EV_CTRL", None)
