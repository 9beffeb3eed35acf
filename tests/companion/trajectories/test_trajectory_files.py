"""Trajectories from files."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.trajectories.from_file import TrajectoryFileError, load_trajectory

DURATION = 8.0


def smooth_motion(t):
    """A motion at rest at 0 and at DURATION, with its two derivatives."""
    x = t / DURATION
    f = x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3)
    df = 140 * x**3 * (1 - x) ** 3 / DURATION
    ddf = 420 * x**2 * (1 - x) ** 2 * (1 - 2 * x) / DURATION**2
    scale = np.array([2.0, -1.0, 0.7])
    start = np.array([-1.0, 0.5, 1.0])
    return start + np.outer(f, scale), np.outer(df, scale), np.outer(ddf, scale)


def csv_of(times, points, header="t,x,y,z"):
    rows = [f"{t!r},{x!r},{y!r},{z!r}" for t, (x, y, z) in zip(times, points, strict=True)]
    return "\n".join([header, *rows, ""])


@pytest.fixture
def written(tmp_path):
    def write(text, name="own.csv"):
        path = tmp_path / name
        if isinstance(text, bytes):
            path.write_bytes(text)
        else:
            path.write_text(text, encoding="utf-8")
        return path

    return write


def refusal(path):
    with pytest.raises(TrajectoryFileError) as caught:
        load_trajectory(path)
    assert str(path) in str(caught.value)
    return str(caught.value).removeprefix(str(path))


def test_a_sampled_motion_comes_back_with_its_derivatives(written):
    samples = np.arange(0.0, DURATION + 0.01, 0.25)
    text = csv_of(samples.tolist(), smooth_motion(samples)[0].tolist())
    trajectory = load_trajectory(written(text))
    t = np.arange(0.0, DURATION, 0.013)
    motion = trajectory.motion(t)
    position, velocity, acceleration = smooth_motion(t)
    np.testing.assert_allclose(motion.position_m, position, atol=1e-5)
    np.testing.assert_allclose(motion.velocity_m_s, velocity, atol=1e-4)
    np.testing.assert_allclose(motion.acceleration_m_s2, acceleration, atol=3e-3)


def test_passes_through_its_points_and_rests_outside(written):
    trajectory = load_trajectory(written("t,x,y,z\n0,0,0,1\n2,1,-1,1.5\n\n5,0.5,0.25,2\n"))
    points = trajectory.position(np.array([0.0, 2.0, 5.0]))
    np.testing.assert_allclose(points, [[0, 0, 1], [1, -1, 1.5], [0.5, 0.25, 2]], atol=1e-12)
    ends = trajectory.motion(np.array([-1.0, 0.0, 5.0, 9.0]))
    np.testing.assert_allclose(ends.position_m[[0, 3]], [[0, 0, 1], [0.5, 0.25, 2]], atol=1e-12)
    np.testing.assert_allclose(ends.velocity_m_s, 0.0, atol=1e-12)
    np.testing.assert_allclose(ends.acceleration_m_s2, 0.0, atol=1e-12)
    assert trajectory.name == "own"
    assert trajectory.scored_s == trajectory.end_s == 5.0


def test_yaml_says_the_same_as_csv(written):
    from_csv = load_trajectory(written("t,x,y,z\n0,0,0,1\n2,1,-1,1.5\n"))
    from_yaml = load_trajectory(
        written("name: hop\npoints:\n  - [0, 0, 0, 1]\n  - [2, 1, -1, 1.5]\n", "own.yml")
    )
    assert from_yaml.name == "hop"
    assert (from_yaml.times_s, from_yaml.points_m) == (from_csv.times_s, from_csv.points_m)


def test_times_are_counted_from_the_first(written):
    trajectory = load_trajectory(written("t,x,y,z\n100,0,0,1\n102,1,0,1\n"))
    assert trajectory.times_s == (0.0, 2.0)


def test_a_spreadsheets_file_with_a_byte_order_mark_is_read(written):
    text = b"\xef\xbb\xbft, x, y, z\r\n0,0,0,1\r\n2,1,0,1\r\n"
    assert load_trajectory(written(text, "OWN.CSV")).points_m[1] == (1.0, 0.0, 1.0)


POINT = "0,0,0,1\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", ", line 1: the header must be t,x,y,z"),
        ("t,x,y\n0,0,0\n", ", line 1: the header must be t,x,y,z"),
        ("0,0,0,1\n1,0,0,1\n", ", line 1: the header must be t,x,y,z"),
        (f"t,x,y,z\n{POINT}1,2,3\n", ", line 3: ['1', '2', '3'] is not four numbers"),
        (f"t,x,y,z\n{POINT}1,2,3,4,5\n", ", line 3: ['1', '2', '3', '4', '5'] is not four"),
        (f"t,x,y,z\n{POINT}1,2,up,4\n", ", line 3: ['1', '2', 'up', '4'] is not four numbers"),
        (f"t,x,y,z\n\n{POINT}1,nan,0,1\n", ", line 4: ['1', 'nan', '0', '1'] is not finite"),
        (f"t,x,y,z\n{POINT}inf,0,0,1\n", ", line 3: ['inf', '0', '0', '1'] is not finite"),
        (f"t,x,y,z\n{POINT}0,0,0,1\n", ", line 3: time 0 s does not come after 0 s. Sort"),
        (f"t,x,y,z\n{POINT}2,0,0,1\n1,0,0,1\n", ", line 4: time 1 s does not come after 2 s"),
        (f"t,x,y,z\n{POINT}0.001,0,0,1\n", ", line 3: less than 10 ms after the point before"),
        (f"t,x,y,z\n{POINT}1e5,0,0,1\n", ": takes 100000 s; at most 3600 s are flown"),
        (f"t,x,y,z\n{POINT}2,0,1e300,1\n", ", line 3: ['2', '0', '1e300', '1'] is farther away"),
        (f"t,x,y,z\n{POINT}", ": at least two points are needed, 1 found"),
        ("t,x,y,z\n", ": at least two points are needed, 0 found"),
        (b"t,x,y,z\n\xff\xfe", ": the trajectory file can't be read: not UTF-8"),
        ("t,x,y,z\n" + "9" * 200_000, ": not CSV: field larger than field limit"),
    ],
)
def test_a_wrong_csv_is_told_by_line(written, text, says):
    assert refusal(written(text)).startswith(says)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", ": give `points`, a list of [t, x, y, z]"),
        ("[1, 2]", ": give `points`"),
        ("points: 3", ": give `points`"),
        ("points: []", ": at least two points are needed, 0 found"),
        ("points: [[0, 0, 0, 1], 7]", ", point 2: [7] is not four numbers"),
        ("points: [[0, 0, 0, 1], [1, true, 0, 1]]", ", point 2: [1, True, 0, 1] is not four"),
        ("points: [[0, 0, 0, .nan]]", ", point 1: [0, 0, 0, nan] is not finite"),
        ("points: [[0, 0, 0, 1], [-1, 0, 0, 1]]", ", point 2: time -1 s does not come after"),
        ("point: []\npoints: []", ": unknown key 'point'"),
        ("name: 5\npoints: []", ": `name` is not text: 5"),
        ("a: &a [0, 0, 0, 1]\npoints: [*a]", ": YAML aliases (*name) are not taken"),
        ("points: [", ": not YAML"),
        ('points: [!!int ""]', ": not YAML"),
        ("points: " + "[" * 5000, ", line 1: nests deeper"),
    ],
)
def test_a_wrong_yaml_is_told_by_point(written, text, says):
    assert refusal(written(text, "own.yaml")).startswith(says)


def test_another_suffix_is_refused(written):
    assert "unknown kind of trajectory file '.txt'. Use .csv" in refusal(written("", "own.txt"))


def test_a_file_that_is_not_there_or_is_a_folder_is_refused(tmp_path):
    assert "No such file" in refusal(tmp_path / "none.csv")
    (tmp_path / "folder.csv").mkdir()
    assert "directory" in refusal(tmp_path / "folder.csv")


def test_a_path_that_no_file_can_have_is_refused(tmp_path):
    with pytest.raises(TrajectoryFileError, match="Check the path"):
        load_trajectory(tmp_path / "a\0b.csv")


def test_a_huge_file_is_not_read(written):
    assert ": larger than 10 MB" in refusal(written("t,x,y,z\n" + " " * 10_000_000))


_CSV_PIECES = st.sampled_from(["t,x,y,z\n", "0,0,0,1\n", "1,2,3,4\n", '"', ",", "\0", "nan", "\n"])
_YAML_PIECES = st.sampled_from(
    ["points:", " [", "]", "[0,0,0,1],", "[1,0,0,1]", "!!int ", "{", "}", ": ", "\n", "- ", "&a "]
)


@settings(deadline=None, derandomize=True, max_examples=150)
@given(st.lists(_CSV_PIECES | _YAML_PIECES | st.text(max_size=4)).map("".join))
def test_any_text_is_a_trajectory_or_a_refusal(tmp_path_factory, text):
    folder = tmp_path_factory.getbasetemp()
    for name in ("any.csv", "any.yaml"):
        path = folder / name
        path.write_text(text, encoding="utf-8", errors="replace")
        try:
            trajectory = load_trajectory(path)
        except TrajectoryFileError:
            continue
        assert np.isfinite(trajectory.position(np.array([0.0, 1.0]))).all()
