"""`export` makes of a recording what the ending of a file's name says."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kiks import Arena, Batch, Khepera, ParameterError, Recording, Simulation, controllers, measures
from kiks.export import kinds
from kiks.export.kinds import CHAMPION, ENDINGS, EVOLUTION, KINDS, export, export_kind, option_names
from kiks.export.pictures import Picture
from kiks.learn.exam import ExamResult
from kiks.model.replaceable import RECORDING, is_replaceable
from kiks.recording.tables import TABLES

ENCODERS = (10, 4)
"""What the robot's first `H` is answered."""


@pytest.fixture(scope="module")
def world() -> Simulation:
    """A robot that has driven around, a ball that rolls, and a second robot that came later."""
    sim = Simulation(Arena.box(400, 300), seed=3)
    sim.place(1, 100, 80, 0.3)
    sim.add_ball(300, 220)
    sim.add_lamp(60, 240)
    return sim


@pytest.fixture(scope="module")
def recording(world: Simulation, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    file = tmp_path_factory.mktemp("recording") / "run.mcap"
    with world.record(file):
        robot = Khepera(world.port(1))
        robot.set_speed(9, 5)
        robot.proximity()
        assert robot.encoders() == ENCODERS
        world.run(2.0)
        world.move_body(1, 300, 220, speed_mm_s=100.0)
        world.add_robot()
        world.run(1.0)
    return Recording(file)


def test_a_picture_of_a_recording_is_that_of_its_world(world: Simulation, recording: Recording, tmp_path: Path) -> None:
    recording.export(tmp_path / "run.png")
    with Image.open(tmp_path / "run.png") as image:
        seen = np.asarray(image).astype(int)
    wanted = np.asarray(Picture.of_simulation(world).image()).astype(int)
    seen, caption = np.split(seen, [len(wanted)])
    assert (caption < 128).any()
    assert 0 < (np.abs(seen - wanted).max(axis=-1) > 8).mean() < 0.05  # without the trails
    recording.export(tmp_path / "early.png", time_s=1.0)
    assert (tmp_path / "early.png").read_bytes() != (tmp_path / "run.png").read_bytes()


def test_lines_stay_sharp_and_a_caption_says_what_is_seen(recording: Recording, tmp_path: Path) -> None:
    for name in ("run.svg", "run.pdf", "again.svg", "again.pdf"):
        recording.export(tmp_path / name)
    text = (tmp_path / "run.svg").read_text()
    # Matplotlib draws the letters, and has them in a comment.
    for words in ("box,", "seed", "3,", "50 mm", "robot 1, from its start", "robot 2, from its start", "lamp", "ball"):
        assert f"<!-- {words} -->" in text, words
    assert "cylinder" not in text
    document = (tmp_path / "run.pdf").read_bytes()
    assert (text.count("<image"), document.count(b"/Subtype /Image")) == (1, 1), "the light of the lamp"
    assert text == (tmp_path / "again.svg").read_text()
    assert document == (tmp_path / "again.pdf").read_bytes()


def test_tables_enter_pandas_and_are_the_same_in_each_kind_of_file(recording: Recording, tmp_path: Path) -> None:
    import pandas as pd
    from scipy.io import loadmat

    names = *TABLES, "proximity", "positions", "H", "floor", "T,2,N"
    tables = {name: recording.columns(name, 1) for name in names}
    batch = Batch(Arena.box(400, 300), worlds=3, robots=2, seed=[5, 7, 6])
    ahead, watching = [0.5] * 18, [measures.path_mm, measures.trajectory(seconds=1, points=2)]
    rollouts = batch.run(controllers.linear(), ahead, seconds=1, measures=watching)
    exam = ExamResult(np.array([True, False]), np.array([[31.0], [2.5]]), ("path_mm",), "drives")
    tables |= {"rollouts": rollouts.columns(), "exam": exam.columns()}
    for name, wanted in tables.items():
        frame, file = pd.DataFrame(wanted), tmp_path / name
        for ending in (".csv", ".parquet", ".mat"):
            if name in ("rollouts", "exam"):
                {"rollouts": rollouts.save, "exam": exam.save}[name](file.with_suffix(ending))
            else:
                recording.export(file.with_suffix(ending), table=name, robot=1)
        pd.testing.assert_frame_equal(pd.read_parquet(file.with_suffix(".parquet")), frame)
        kinds = {column: "str" for column, values in wanted.items() if values.dtype.kind == "U"}
        read = pd.read_csv(file.with_suffix(".csv"), dtype=kinds, keep_default_na=False)
        pd.testing.assert_frame_equal(read, frame, check_dtype=False, check_exact=True)
        found = loadmat(file.with_suffix(".mat"))
        assert [column for column in found if not column.startswith("__")] == list(wanted)
        np.testing.assert_array_equal(found[next(iter(wanted))].ravel(), frame.iloc[:, 0])
    assert loadmat(tmp_path / "wire.mat")["data"][0, 0][0] == r"D,9,5\n"
    (counts,) = recording.table("readings")["counts"].tolist()
    assert [tables["readings"][f"counts_{k}"][0] for k in range(8)] == counts
    assert [tables["proximity"][f"value_{k}"][0] for k in range(8)] == counts
    assert [tables["H"][f"value_{k}"].tolist() for k in (0, 1)] == [[value] for value in ENCODERS]
    assert (list(tables["floor"]), list(tables["T,2,N"])) == (["time_s", "robot", "value_0"], ["time_s", "robot"])
    in_rows = zip(*(tables["rollouts"][name].tolist() for name in ("world", "robot", "seed")), strict=True)
    assert [*in_rows] == [(world, robot, (5, 7, 6)[world]) for world in range(3) for robot in range(2)]
    assert (tables["rollouts"]["heading_rad_2"] == rollouts.values[..., -1].ravel()).all()
    twice = batch.run(controllers.linear(), ahead, seconds=0.1, measures=[measures.goal_mm(1, k) for k in (1, 2)])
    with pytest.raises(ParameterError, match=r"must have different names, .*measure\.named"):
        twice.columns()


OF_RECORDINGS = [name for name, kind in KINDS.items() if kind.source == kinds.RECORDING]


@pytest.mark.parametrize(
    ("kind", "ending"), [(kind, ending) for kind in OF_RECORDINGS if kind != "photo" for ending in KINDS[kind].endings]
)
def test_what_an_export_has_written_may_be_replaced(
    recording: Recording, tmp_path: Path, kind: str, ending: str
) -> None:
    recording.export(file := tmp_path / f"run{ending}", kind=kind)
    assert is_replaceable(file, ending)
    others = {each for each in ENDINGS if is_replaceable(file, each)} - {ending}
    assert not others & {".csv", ".html"}
    assert not is_replaceable(file, RECORDING)
    if ending in (".gif", ".webp"):
        with Image.open(file) as image:
            assert getattr(image, "n_frames", 1) > 2


def test_a_recording_is_not_replaced_by_what_is_made_of_it(recording: Recording) -> None:
    file = recording.log.reader.path
    assert is_replaceable(file, RECORDING)
    assert not any(is_replaceable(file, ending) for ending in ENDINGS)
    with pytest.raises(ParameterError, match=r"the file must end in \.mp4, .*, but it was '.*run\.mcap'"):
        recording.export(file)


def test_each_ending_has_a_kind_whose_options_are_those_of_its_function() -> None:
    assert {export_kind(f"run{ending}") for ending in ENDINGS} == {*OF_RECORDINGS} - {"figures", "photo"}
    assert [export_kind(f"run{each}", source=EVOLUTION) for each in (".gif", ".html")] == ["ghosts", "ghost page"]
    assert option_names("picture") == ["time_s"]
    assert export_kind("champion.html", source=CHAMPION) == "champion page"
    assert export_kind("run.PNG", "photo") == "photo"


def test_mistakes_get_a_clear_error(recording: Recording, tmp_path: Path) -> None:
    for name, options, words in (
        ("run.doc", {}, "the file must end in .mp4, .gif"),
        ("run.png", {"fps": 5}, "fps must be left out of a picture, but it was 5"),
        ("run.mp4", {"robo": 5}, "Did you mean 'robot'?"),
        ("run.mp4", {"kind": "photo"}, "a photo must end in .png or .jpg"),
        ("run.png", {"kind": "foto"}, "kind must be one of 'film', .* Did you mean 'photo'?"),
        ("run.png", {"time_s": 9}, "time_s must be from 0 to 3"),
        ("run.csv", {"table": "pose"}, "Did you mean 'poses'?"),
    ):
        with pytest.raises(ParameterError, match=words):
            recording.export(tmp_path / name, **options)
    with pytest.raises(ParameterError, match="a picture must be of one recording, but there are 2"):
        export([recording, recording], tmp_path / "run.png")
    assert not list(tmp_path.iterdir())
