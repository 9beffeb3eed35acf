"""The architecture's picture and table are those of the imports."""

import pytest

from tools.docs.architecture import DATA, PACKAGES, PAGE, as_text, gather, with_table
from tools.docs.architecture_picture import draw, reduced


@pytest.fixture(scope="module")
def data():
    return gather()


def test_the_committed_graph_is_what_the_imports_are_now(data):
    told = "Run: python -m tools.docs.architecture"
    assert DATA.read_text(encoding="utf-8") == as_text(data), told


def test_the_pages_table_is_what_the_imports_are_now(data):
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_table(page, data), "Run: python -m tools.docs.architecture"


def test_every_room_has_a_place_in_a_layer_and_says_what_it_does(data):
    placed = [room for rows in data["layers"].values() for row in rows for room in row]
    assert sorted(placed) == sorted(data["rooms"])
    assert all(data["rooms"].values())
    assert set(data["layers"]) == set(PACKAGES)


def test_the_packages_meet_in_lockstep_alone(data):
    across = [
        (room, below)
        for room, imported in data["imports"].items()
        for below in imported
        if room.partition(".")[0] != below.partition(".")[0]
    ]
    assert across == [("companion.lockstep", "sitl_shim.lockstep")]


def test_an_arrow_is_left_out_only_where_others_lead(data):
    assert reduced({"a": ["b", "c"], "b": ["c"], "c": []}) == {"a": ["b"], "b": ["c"], "c": []}

    def reached(room, imports):
        found = set(imports.get(room, ()))
        return found.union(*(reached(below, imports) for below in found))

    kept = reduced(data["imports"])
    assert all(reached(room, kept) == reached(room, data["imports"]) for room in data["imports"])


def test_the_picture_names_every_room(data, tmp_path):
    picture = draw(data, tmp_path / "picture.svg").read_text(encoding="utf-8")
    assert all(f">{room.partition('.')[2]}<" in picture for room in data["rooms"])
