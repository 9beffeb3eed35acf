"""What a check found, for a person at 80 columns and for machines."""

import io
import json
import math
from dataclasses import replace

from rich.console import Console

from companion.preflight.finding import Finding, ParameterChange, Verdict
from companion.preflight.judgement import judge
from companion.report.findings import findings_object, print_findings, summary
from companion.thrust_meaning import ThrustMeaning
from tests.companion.preflight.healthy import ARDUPILOT, PLAN, PX4, with_parameters

BAD = replace(
    with_parameters(ARDUPILOT, GUID_TIMEOUT=3.0, FS_GCS_ENABLE=0.0, MAV_GCS_SYSID=255.0),
    thrust=ThrustMeaning("climb_rate", 2.5, 1.5),
)


def printed(findings):
    out = io.StringIO()
    print_findings(Console(file=out, width=80, highlight=False), findings, "check of it")
    return out.getvalue()


def test_it_reads_well_at_80_columns_without_colour():
    text = printed(judge(BAD, PLAN))
    lines = text.splitlines()
    assert max(map(len, lines)) <= 80
    assert "\x1b" not in text
    assert lines[0] == "check of it"
    (row,) = [line for line in lines if line.startswith("GUID_TIMEOUT ") and "WARNING" in line]
    assert "3 s: a dead companion's last setpoint" in row
    assert any(line.lstrip().startswith("→ Set 0.5 s or less.") for line in lines)
    assert lines[-1] == "2 warnings: it would fly, see above"


def test_every_subject_stays_on_one_line():
    subjects = [finding.subject for finding in (*judge(BAD, PLAN), *judge(PX4, PLAN))]
    subjects += ["ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"]
    text = printed([Finding(subject, "found") for subject in subjects])
    for subject in subjects:
        assert any(line.startswith(subject + " ") for line in text.splitlines()), subject


def test_the_parameters_to_set_are_listed_once():
    text = printed(judge(BAD, PLAN))
    listed = text.split("to set, or have set by --fix:")[1]
    assert listed.count("GUID_TIMEOUT 3 → 0.5") == 1
    assert listed.count("MAV_GCS_SYSID 255 → 1") == 1


def test_with_nothing_to_set_nothing_is_listed():
    text = printed(judge(PX4, PLAN))
    assert "to set" not in text
    assert text.splitlines()[-1] == "fine: nothing stands against a flight"


def test_the_summary_counts():
    findings = [Finding("a", "b", verdict) for verdict in Verdict for _ in range(2)]
    assert summary(findings) == "2 refused, 2 warnings: it would not fly like this"


def test_for_machines_all_is_there_and_nothing_that_json_cannot_say():
    findings = [Finding("a", "b", Verdict.WARNING, "c", ParameterChange("P", 1.0, 2.0, "why"))]
    facts = replace(PX4, battery=replace(PX4.battery, voltage_v=math.nan))
    data = json.loads(json.dumps(findings_object(findings, facts, "udp"), allow_nan=False))
    assert data["verdict"] == "warning"
    assert data["findings"] == [
        {
            "subject": "a",
            "found": "b",
            "verdict": "warning",
            "advice": "c",
            "change": {"name": "P", "old": 1.0, "new": 2.0, "why": "why"},
        }
    ]
    assert data["measured"]["battery"]["voltage_v"] is None
    assert data["measured"]["parameters"]["COM_OF_LOSS_T"] == 1.0
    assert findings_object([], None, "udp")["measured"] is None
