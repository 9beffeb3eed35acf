import sys

import numpy as np
import pytest

from companion.commands.export import ExportRequest, run_export
from companion.export.errors import ExportError
from companion.recording.mcap_reader import read_records

rerun_chunk = pytest.importorskip("rerun.chunk")


@pytest.fixture(scope="module")
def chunks(flown_once, tmp_path_factory):
    """What the recording holds, by its own reader: the chunks of each entity."""
    folder = tmp_path_factory.mktemp("rerun")
    run_export(ExportRequest(flown_once, "rerun", folder))
    found = {}
    for chunk in rerun_chunk.RrdReader(folder / "flight.rrd").stream().to_chunks():
        found.setdefault(chunk.entity_path, []).append(chunk)
    return found


def columns(chunks, entity, ending):
    """Values of a column of an entity, in order."""
    values = []
    for chunk in chunks[entity]:
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.endswith(ending):
                values += batch.column(name).to_pylist()
    return values


def test_the_vehicle_moves_as_reported(chunks, flown_once):
    control = [r.values for r in read_records(flown_once / "flight.mcap") if r.topic == "control"]
    flown = [c["position_enu_m"] for c in control if None not in c["position_enu_m"]]
    told = np.array([row[0] for row in columns(chunks, "/world/vehicle", "translation")])
    assert told == pytest.approx(np.array(flown), abs=1e-5)


def test_the_paths_stand_still_and_the_figures_move(chunks):
    for entity in ("/world/desired_path", "/world/flown_path", "/world/geofence"):
        assert all(chunk.is_static for chunk in chunks[entity])
    for entity in ("/plots/error_mm", "/plots/y_tilde/bound/z", "/plots/position/desired/x"):
        times = {name for chunk in chunks[entity] for name in chunk.timeline_names}
        assert times == {"flight_time", "autopilot_time"}


def test_the_error_is_in_millimetres(chunks):
    errors = [row[0] for row in columns(chunks, "/plots/error_mm", "scalars")]
    assert 1.0 < max(errors) < 500.0


def test_the_truth_and_the_messages_are_there(chunks):
    assert sum(chunk.num_rows for chunk in chunks["/world/true_position"]) > 1000
    texts = [row[0] for row in columns(chunks, "/messages", "text")]
    assert any(text.startswith("phase track") for text in texts)


def test_without_rerun_one_line_says_how_to_get_it(flight, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(ExportError, match=r"pip install 'companion\[rerun\]'") as caught:
        run_export(ExportRequest(flight, "rerun"))
    assert "\n" not in str(caught.value)
    assert sorted(p.name for p in flight.iterdir()) == ["flight.mcap", "flight.tlog"]


def test_a_recording_is_not_written_over(flight):
    (flight / "flight.rrd").write_bytes(b"mine")
    with pytest.raises(ExportError, match="is there already"):
        run_export(ExportRequest(flight, "rerun"))
    assert (flight / "flight.rrd").read_bytes() == b"mine"
