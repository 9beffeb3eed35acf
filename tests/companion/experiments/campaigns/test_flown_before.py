import re
from pathlib import Path

import pytest

from companion.commands.campaign import CampaignRequest, run_campaign_file
from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns import flown_before
from companion.experiments.campaigns.batches import batch_key_of
from companion.experiments.campaigns.flown_before import check_point, plan_of_folder
from companion.experiments.campaigns.plan import load_plan
from companion.experiments.campaigns.results import JOURNAL
from tests.companion.experiments.campaigns import stand_ins

FILE = """\
name: named
keep: figures
base: {trajectory: way.yaml}
sample: {method: latin-hypercube, points: 4}
parameters:
  plant.mass: {low: 0.9, high: 1.1}
  wind: [calm]
"""
WAY = "points: [[0, 0, 0, 1], [0.5, 0.1, 0, 1], [1.0, 0, 0, 1]]\n"


@pytest.fixture
def file(tmp_path, monkeypatch):
    """A campaign's file, named as one does from its folder."""
    (tmp_path / "named.yaml").write_text(FILE)
    (tmp_path / "way.yaml").write_text(WAY)
    monkeypatch.chdir(tmp_path)
    return Path("named.yaml")


@pytest.fixture
def out(file, tmp_path):
    run_campaign_file(CampaignRequest(str(file), jobs=1, out=tmp_path / "out"), stand_ins.figures)
    return tmp_path / "out"


def test_a_folder_knows_its_points_whatever_became_of_the_file_and_wherever_one_is(
    file, out, tmp_path, monkeypatch
):
    file.write_text(FILE.replace("0.9", "0.5"))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")

    plan = plan_of_folder(out)

    assert plan.text == FILE
    assert all(flight.values["plant.mass"] > 0.9 for flight in plan.flights)
    assert plan.config.base.trajectory == str(tmp_path / "way.yaml")
    assert [check_point(out, plan, point) for point in range(4)] == [None] * 4


def test_a_point_whose_files_have_changed_is_refused(out, tmp_path):
    (tmp_path / "way.yaml").write_text(WAY.replace("0.5", "0.4"))
    request = CampaignRequest(str(out), point=2, out=tmp_path / "again")

    with pytest.raises(ConfigError, match=r"point 2 names files .* that have changed since"):
        run_campaign_file(request)

    assert not (tmp_path / "again").exists()


def test_a_point_that_other_code_flew_is_told(out, monkeypatch):
    plan = plan_of_folder(out)
    journal = (out / JOURNAL).read_text()
    (out / JOURNAL).write_text(re.sub(r'"key": "', '"key": "other-', journal))
    monkeypatch.setattr(flown_before, "code_digest", lambda: "another")

    assert "point 1 was flown by other code, or with other files" in check_point(out, plan, 1)


def test_a_batched_point_is_known_by_the_content_of_its_files_and_not_by_their_paths(
    file, tmp_path, monkeypatch
):
    file.write_text("engine: batched\n" + FILE)
    here = batch_key_of(load_plan(str(file)), load_plan(str(file)).flights[1])
    plan = load_plan(str(tmp_path / "named.yaml"))

    assert batch_key_of(plan, plan.flights[1]) == here
    assert batch_key_of(plan, plan.flights[2]) != here
    (tmp_path / "other.yaml").write_text(WAY.replace("0.5", "0.4"))
    file.write_text("engine: batched\n" + FILE.replace("way", "other"))
    plan = load_plan(str(file))
    assert batch_key_of(plan, plan.flights[1]) != here


def test_a_plan_that_is_sampled_otherwise_today_is_refused(out):
    manifest = out / "campaign.json"
    manifest.write_text(re.sub(r'"plan": "..', '"plan": "zz', manifest.read_text()))

    with pytest.raises(ConfigError, match="its points are not those that this program takes"):
        plan_of_folder(out)


def test_a_folder_is_for_points_alone_and_takes_no_log_among_its_files(file, out, tmp_path):
    with pytest.raises(ConfigError, match=r"is a folder\. Give the campaign's file"):
        run_campaign_file(CampaignRequest(str(out)))
    with pytest.raises(ConfigError, match=r"it holds no campaign\.json"):
        run_campaign_file(CampaignRequest(str(tmp_path), point=1))
    with pytest.raises(ConfigError, match=r"is a campaign's folder; .* --out .*out/again/1"):
        run_campaign_file(CampaignRequest(str(file), point=1, out=out))
