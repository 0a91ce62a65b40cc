"""Task files: a ready-made task with changes, in TOML."""

from pathlib import Path

import pytest
from tests.learn.small import SHY, refused

import kiks
from kiks.learn.fingerprint import differing
from kiks.model.arena_file import save_arena


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_arena(kiks.Arena.box(400, 300), tmp_path / "room.toml")
    save_arena(kiks.Arena.box(500, 300), tmp_path / "hall.toml")
    (tmp_path / "shy.py").write_text(SHY)
    return tmp_path


def load(folder: Path, text: str, name: str = "mine.toml") -> kiks.Task:
    (folder / name).write_text("task = 1\n" + text)
    return kiks.tasks.load(str(folder / name))


def test_keys_left_out_keep_the_ready_made_values_and_the_second_side_has_a_controller_of_its_own(folder: Path) -> None:
    base = kiks.tasks.load("gather")
    task = load(folder, 'base = "gather"\n')
    assert task.name == "mine"
    for name in ("measures", "fitness", "seconds", "worlds", "axes", "robot", "robots", "timing", "starts"):
        assert getattr(task, name) == getattr(base, name), name
    assert task.controller is base.controller
    task = load(folder, 'base = "pursuit"\n[against]\nkind = "gru"\nunits = 2\n')
    base = kiks.tasks.pursuit()
    assert task.against.controller is kiks.controllers.gru(units=2)
    assert task.controller is base.controller
    words = "against must be left out, because 'avoid' has one side"
    refused(words, load, folder, 'base = "avoid"\n[against]\nkind = "gru"\n')


def test_all_keys(folder: Path) -> None:
    (folder / "my.toml").write_bytes((Path(kiks.__file__).parent / "model/robots/khepera.toml").read_bytes())
    task = load(
        folder,
        'base = "avoid"\nname = "in a room"\nseconds = 2\nworlds = 4\n'
        'arenas = ["room.toml", "hall.toml"]\n'
        'exam = "hall.toml"\nrobot = "my.toml"\nrobots = 1\nstarts = "arena"\nperiod_ms = 50\nthink_ms = 2.5\n'
        'baud = 38400\n[controller]\nkind = "gru"\nunits = 2\n',
    )
    assert (task.name, task.seconds, task.worlds, task.starts) == ("in a room", 2.0, 4, "arena")
    assert [arena.width_mm for arena in task.arenas] == [400, 500]
    assert [arena.width_mm for arena in task.exam.arenas] == [500]
    assert (task.robot, task.timing) == (str((folder / "my.toml").resolve()), kiks.Timing(0.05, 38400, 0.0025))
    assert task.controller is kiks.controllers.gru(units=2)
    assert load(folder, 'base = "avoid"\nbaud = 0\n').timing.baud is None
    assert kiks.tasks.load(str(folder / "mine.toml"), kiks.controllers.linear()).controller.name == "linear"
    own = load(folder, 'base = "avoid"\n[controller]\nfunction = "shy.py:shy"\n')
    assert (own.controller.name, own.parameter_count) == ("shy", 1)


def test_the_digest_depends_on_what_the_file_says_and_on_the_files_that_it_names(folder: Path) -> None:
    text = 'base = "avoid"\narenas = ["room.toml"]\n[controller]\nfunction = "shy.py:shy"\n'
    first = load(folder, text).digest()
    assert load(folder, "# a word\n" + text).digest() == first
    assert differing(load(folder, "seconds = 3\n" + text).digest(), first) == "seconds"
    save_arena(kiks.Arena.box(401, 300), folder / "room.toml")
    assert differing(load(folder, text).digest(), first) == "arenas"
    code = (folder / "shy.py").read_text()
    (folder / "shy.py").write_text(code.replace("parameters[0]", "-parameters[0]"))
    assert differing(load(folder, text).digest(), first) == "arenas, controller"


def test_wrong_files_are_errors_of_one_short_line(folder: Path) -> None:
    for text, message in (
        ("", "base must be given"),
        ('base = "avoyd"', "base must be .* Did you mean 'avoid'"),
        ("world = 3", "Did you mean 'worlds'"),
        ("worlds = 30", "worlds must be a multiple of the number of arenas, 16"),
        ("seconds = nan", "seconds must be a finite number, but it was nan"),
        ('name = "../../out"', "name must be a text of 1 to 60 letters"),
        ("arenas = []", "arenas must have at least 1 item"),
        ('arenas = ["../room.toml"]', "arenas must lead to a file in"),
        ('arenas = ["/etc/passwd"]', "arenas must lead to a file in"),
        ('worlds = 1\narenas = ["nowhere.toml"]', "must exist, but there is no such file"),
        ('exam = "nowhere.toml"', "must exist, but there is no such file"),
        ('robot = "kepera"', "Robot file|robot must|must exist"),
        ("baud = 50", "baud must be at least 110"),
        ("period_ms = 1\nbaud = 0", "period_s must be at least 0.01 without a line"),
        ('[controller]\nkind = "mlp"\nhidden = [1000000000]', r"controller.hidden\[0\] must be at most 512"),
        ('[controller]\nfunction = "../shy.py:shy"', "must lead to a file in"),
    ):
        base = "" if text.startswith("base") or not text else 'base = "avoid"\n'
        error = refused(message, lambda base=base, text=text: load(folder, base + text).digest())
        assert len(error.replace(str(folder), "")) < 400


def test_the_example_is_a_task_and_is_quoted_in_the_documentation() -> None:
    root = Path(__file__).parents[2]
    text = (root / "examples/office_task.toml").read_text(encoding="utf-8")
    assert f"```toml\n{text}```" in (root / "docs/howto/evolution.md").read_text(encoding="utf-8")
    task = kiks.tasks.load(str(root / "examples/office_task.toml"))
    assert (task.name, task.controller.name, task.arenas[0].name) == ("office_task", "mlp", "Office")
