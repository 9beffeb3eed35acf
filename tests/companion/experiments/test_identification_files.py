"""What an identification ends with: files that belong together, and a verdict on each gains."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from companion.config.models import VehicleConfig
from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from companion.experiments import identification_files
from companion.experiments.identification_files import conclude
from companion.identification import files
from companion.identification.estimates import Estimate
from companion.identification.recommend import recommend
from companion.report.identification_table import wide_figures
from tests.companion.identification.identified_for_tests import identified, response

RECORDING = SimpleNamespace(
    time_s=np.arange(0.0, 5.0, 0.01),
    thrust_meaning=SimpleNamespace(kind="collective"),
    autopilot="px4",
)


@pytest.fixture(scope="module")
def base():
    return validate(VehicleConfig, read_yaml(find_config("vehicle", "bebop2")))


@pytest.fixture(scope="module")
def recommendation(base):
    return recommend(base, generations=20)


@pytest.fixture(scope="module")
def first(base, recommendation, tmp_path_factory):
    """An identification's end, once: to certify takes seconds."""
    folder = tmp_path_factory.mktemp("first")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "recommend", lambda *_, **__: recommendation)
        return conclude(identified(), RECORDING, base, folder, "test"), folder


@pytest.fixture
def gains(monkeypatch, recommendation, first):
    """Neither searched nor certified once more."""
    monkeypatch.setattr(files, "recommend", lambda *_, **__: recommendation)
    for name, verdict in zip(("certify", "certify_plus"), first[0].verdicts, strict=True):
        certificate = verdict.certificate
        monkeypatch.setattr(identification_files, name, lambda _, found=certificate: found)


def changed(certificate, **changes):
    """With the first condition of x changed."""
    x = certificate.axes[0]
    condition = replace(x.conditions[0], **changes)
    x = replace(x, conditions=(condition, *x.conditions[1:]))
    return replace(certificate, axes=(x, *certificate.axes[1:]))


def test_both_controllers_are_certified_and_the_record_says_so(first):
    result, folder = first
    assert [verdict.controller for verdict in result.verdicts] == ["mpc-l1", "mpc-l1-plus"]
    assert [type(v.certificate).__name__ for v in result.verdicts] == [
        "Certificate",
        "PlusCertificate",
    ]
    record = json.loads((folder / "identify.json").read_text(encoding="utf-8"))
    assert record == json.loads(json.dumps(result.record))
    for verdict in result.verdicts:
        said = record["certificates"][verdict.controller]
        assert said == {"holds": verdict.certificate.holds, "note": verdict.note}
    assert record["certified"] is result.certified


@pytest.mark.parametrize(
    ("name", "controller"), [("certify", "mpc-l1"), ("certify_plus", "mpc-l1-plus")]
)
def test_gains_of_either_that_do_not_hold_are_not_certified(
    tmp_path, base, gains, monkeypatch, name, controller
):
    found = getattr(identification_files, name)(None)
    failing = changed(found, holds=False, reason="too quick", caution="")
    monkeypatch.setattr(identification_files, name, lambda _: failing)
    result = conclude(identified(), RECORDING, base, tmp_path, "test")
    failed = {verdict.controller: verdict.note for verdict in result.verdicts if not verdict.holds}
    assert not result.certified
    assert "x: too quick" in failed[controller]
    assert result.record["verdict"] == "uncertified"
    assert f"{controller}: x: too quick" in result.record["note"]


def test_a_caution_is_no_failure(tmp_path, base, gains, monkeypatch):
    mild = changed(identification_files.certify_plus(None), holds=True, reason="", caution="mind")
    monkeypatch.setattr(identification_files, "certify_plus", lambda _: mild)
    plus = conclude(identified(), RECORDING, base, tmp_path, "test").verdicts[1]
    assert plus.holds
    assert plus.note == ""


def test_nothing_is_written_before_all_of_it_is_known(tmp_path, base, gains, monkeypatch):
    def interrupted(_):
        assert list(tmp_path.iterdir()) == []
        raise KeyboardInterrupt

    monkeypatch.setattr(identification_files, "certify_plus", interrupted)
    with pytest.raises(KeyboardInterrupt):
        conclude(identified(), RECORDING, base, tmp_path, "test")
    assert list(tmp_path.iterdir()) == []


def test_the_search_tells_how_far_it_is(base):
    told = []
    recommend(base, generations=2, progress=lambda done, total: told.append((done, total)))
    assert told[0] == (1, 6)
    assert told[-1] == (6, 6)
    assert [done for done, _ in told] == sorted(done for done, _ in told)


def test_figures_that_are_known_roughly_are_named():
    assert wide_figures(identified()) == ()
    rough = replace(
        response(12.0, 0.8, 0.040),
        natural_frequency_rad_s=Estimate(12.0, 3.6, "rad/s"),
        dead_time_s=Estimate(0.040, 0.012, "s"),
    )
    found = identified(
        roll=rough,
        hover_thrust=Estimate(0.5, 0.012, "1"),
        tilt_gain=Estimate(1.0, 0.2, ""),
    )
    assert wide_figures(found) == (
        "roll ωn 12 ± 3.6 rad/s (wider than 10%)",
        "roll dead time 40 ± 12 ms (wider than 10 ms)",
        "tilt gain 1 ± 0.2 (wider than 10%)",
        "hover thrust 0.5 ± 0.012 (wider than 2%)",
    )


def test_the_note_of_the_record_names_what_is_known_roughly(tmp_path, base, gains):
    found = identified(hover_thrust=Estimate(0.5, 0.012, "1"))
    result = conclude(found, RECORDING, base, tmp_path, "test")
    assert result.wide
    assert result.wide[0] in result.record["note"]
    assert result.record["wide_intervals"] == list(result.wide)
