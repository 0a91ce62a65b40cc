"""Compiled code on the disk: whatever has become of it, calls give what they should, and one line tells of it."""

import os
import pickle
import random
import re
import shutil
import signal
import stat
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numba
import pytest
from tests.at_length import share
from tests.model.refusals import full_disk
from tests.stranger import STRANGER, as_stranger, needs_root

from kiks.engine import code_cache, compiling
from kiks.engine.code_cache import is_compiled
from kiks.engine.compiling import LAST, entry


def double_of(number: Any) -> Any:
    return number + number


def call(argument: Any = 21) -> bool:
    """Call the function as a new process would; return whether it came from the disk."""
    function = entry(double_of)
    assert function(argument) == 2 * argument
    return sum(function.stats.cache_hits.values()) == 1


def files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.code"))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache with the function's machine code, compiled once for the tests that begin with it."""
    folder = tmp_path_factory.mktemp("compiled")
    with pytest.MonkeyPatch.context() as context:
        context.setenv("NUMBA_CACHE_DIR", str(folder))
        call()
    return folder


@pytest.fixture(autouse=True)
def _fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "temporary").mkdir(0o700)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    code_cache.tell.cache_clear()
    monkeypatch.setattr(compiling, "_LINES", {})


@pytest.fixture
def kept(compiled: Path, tmp_path: Path, _fresh: None) -> Path:
    """Return the file with the function's machine code in the user's cache."""
    shutil.copytree(compiled, tmp_path / "cache")
    (file,) = files(tmp_path)
    return file


@pytest.fixture
def another_version(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Be another version of Numba."""
    with monkeypatch.context() as context:
        context.setattr(numba, "__version__", "0.0")
        code_cache._version.cache_clear()
        yield
    code_cache._version.cache_clear()


def test_the_second_call_comes_from_the_disk(tmp_path, caplog):
    assert not is_compiled("double_of")
    assert [call(), call(), call(0.5), call(0.5), call()] == [False, True, False, True, True]
    assert is_compiled("double_of")
    assert not is_compiled("double")
    assert len(files(tmp_path)) == 2
    assert not caplog.records


def test_a_start_that_was_interrupted_has_not_compiled_all():
    folder = next(code_cache.cache_folders())
    folder.mkdir(parents=True)
    digest = code_cache.digest_of("kiks.engine.step")
    (folder / f"kiks.engine.step.advance-{digest}-0123456789abcdef.code").touch()
    assert is_compiled("advance")
    assert not is_compiled(LAST)


def flipped(data: bytes, seed: int) -> bytes:
    place = random.Random(seed).randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << seed % 8]) + data[place + 1 :]


class Bomb:
    """What a pickle may be."""

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (os.environ["KIKS_TEST_BOMB"],)


@pytest.mark.slow
def test_a_damaged_file_is_thrown_away(kept, tmp_path, caplog):
    whole = kept.read_bytes()
    damaged = [b"\n" + whole, whole * 2, bytes(1000), b"1 2"]
    damaged += [whole[: int(part * len(whole))] for part in (0, 0.001, 0.1, 0.5, 0.999)]
    for data in (*damaged, *(flipped(whole, seed) for seed in range(share(4, 20)))):
        kept.write_bytes(data)
        caplog.clear()
        code_cache.tell.cache_clear()
        assert not call()
        assert [record.getMessage().split(" in ")[0] for record in caplog.records] == ["Damaged files"]
        assert call()
        assert files(tmp_path) == [kept]


@pytest.mark.parametrize("rights", [0o620, 0o602, 0o600])
def test_code_in_files_that_others_can_write_is_not_run(rights, kept, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("KIKS_TEST_BOMB", str(tmp_path / "bombed"))
    key, payload = pickle.dumps(Bomb()), pickle.dumps(Bomb())
    head = [code_cache._FORMAT, b"%d" % len(key), code_cache._digest(key), code_cache._digest(payload)]
    kept.write_bytes(b" ".join(head) + b"\n" + key + payload)
    kept.chmod(rights)
    if rights == 0o600:
        # All that tells it from a file of ours is whose it is.
        here = kept.stat().st_uid
        monkeypatch.setattr(code_cache, "_user", lambda: here + 1)
        if here == 0:
            os.chown(kept, 4321, -1)
    assert not call()
    assert not (tmp_path / "bombed").exists()
    assert "files that you alone can write" in caplog.text
    monkeypatch.undo()


OTHER = 4321
"""A user who is neither root nor the one who acts."""


@pytest.fixture
def open_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder to which all may write, as /tmp is, and the place of temporary files."""
    with tempfile.TemporaryDirectory(dir="/tmp") as name:
        Path(name).chmod(0o1777)
        monkeypatch.setattr(tempfile, "tempdir", name)
        yield Path(name)


@needs_root
@pytest.mark.parametrize("user", [0, STRANGER])
@pytest.mark.parametrize(("cache", "level"), [("/proc/none", 0), ("named", 0), ("named", 1)])
def test_code_in_a_folder_of_another_user_is_not_run(user, cache, level, open_folder, monkeypatch, caplog):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(open_folder / cache))
    acting = as_stranger if user else nullcontext
    with acting():
        assert [call(), call()] == [False, True]
    (file,) = files(open_folder)
    assert file.stat().st_uid == user
    caplog.clear()
    file.parents[level].chmod(0o755)
    os.chown(file.parents[level], OTHER, -1)
    with acting():
        assert not call()
    assert "files that you alone can write" in caplog.text
    assert file.exists()


@needs_root
def test_a_link_of_another_user_leads_to_no_code(open_folder, monkeypatch, caplog):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(open_folder / "own"))
    assert [call(), call()] == [False, True]
    (open_folder / "kiks").symlink_to("own/kiks")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(open_folder))
    assert call()  # a link of one's own
    os.chown(open_folder / "kiks", OTHER, -1, follow_symlinks=False)
    assert not call()
    assert "files that you alone can write" in caplog.text


class LateError(Exception):
    pass


@pytest.mark.parametrize(
    ("owner", "name"),
    [(os, "fstat"), (code_cache, "_digest"), (pickle, "loads"), (code_cache._Result, "_rebuild"), (os, "fsync")],
)
def test_what_a_signal_raises_while_code_is_loaded_or_kept_goes_on(owner, name, kept, tmp_path, monkeypatch, caplog):
    is_loaded, real = name != "fsync", getattr(owner, name)

    def reach(*args: Any, **words: Any) -> Any:
        signal.raise_signal(signal.SIGALRM)
        return real(*args, **words)

    for error in (TimeoutError("time is up"), ValueError("late"), LateError()):

        def end(*_: object, error: Exception = error) -> None:
            raise error

        if not is_loaded:
            kept.unlink(missing_ok=True)
        before = signal.signal(signal.SIGALRM, end)
        try:
            with monkeypatch.context() as context:
                context.setattr(owner, name, reach)
                with pytest.raises(type(error)) as caught:
                    call()
        finally:
            signal.signal(signal.SIGALRM, before)
        assert caught.value is error
        assert not caplog.records
        assert len(files(tmp_path)) == is_loaded
        assert call() == is_loaded


def test_concurrent_writes_of_programs_are_all_kept():
    one, other = entry(double_of), entry(double_of)
    contexts = one.targetctx, other.targetctx
    whole, real = (numba.int64,), (numba.float64,)
    # Both look before either writes.
    assert one._cache.load_overload(whole, contexts[0]) is None
    assert other._cache.load_overload(real, contexts[1]) is None
    one.compile(whole)
    other.compile(real)
    other.compile(whole)
    assert [call(1), call(1.5)] == [True, True]


KERNELS = {
    "kiks.engine.f": b'"""A file."""\nfrom kiks.units import X\ndef f(a):\n    """A number."""\n    return a + X\n',
    "kiks.engine.g": b"from kiks.engine.f import f\n@linked(types.void())\ndef g(): f(1)\ndef h(): f(2)\n",
    "kiks.engine.entries": b"from kiks.engine import g\n@entry\ndef e(): g.h()\n",
    "kiks.engine.calls": b"from kiks.engine.g import g\n@entry\ndef c(): g()\n",
    "kiks.engine.motor": b"from kiks.units import Z\ndef move(): return Z\n",
    "kiks.engine.simd.lanes": b"def add(): pass\n",
    "kiks.units": b'"""Units."""\nY = 2\nX = 1 + Y\n"""A number."""\nZ = 3\n',
}


def test_a_change_concerns_what_is_compiled_from_it():
    before = code_cache._syntax(KERNELS)
    for module, old, new, changed in (
        ("engine.f", b"A number", b"A sum", ""),
        ("engine.f", b"a + X", b"a + X  # a comment", ""),
        ("engine.f", b"a + X", b"X + a", "f g entries"),
        ("engine.g", b"f(1)", b"f(3)", "g entries"),
        ("engine.calls", b"g()\n", b"g(4)\n", "calls"),
        ("engine.motor", b"return Z", b"return -Z", "motor"),
        ("engine.simd.lanes", b"pass", b"return", "f g entries calls motor simd.lanes"),
        ("units", b"Y = 2", b"Y = 3", "f g entries"),
        ("units", b"Z = 3", b"Z = 4", "motor"),
        ("units", b"Z = 3", b"Z = 3\ndef g(): pass", ""),
    ):
        name = f"kiks.{module}"
        assert old in KERNELS[name]
        after = code_cache._syntax(KERNELS | {name: KERNELS[name].replace(old, new)})
        differ = {each for each in before if before[each] != after[each]}
        assert differ == {f"kiks.engine.{each}" for each in changed.split()}


def test_the_camera_is_no_part_of_the_motors():
    before, sources = code_cache._digests(), code_cache._sources()
    assert {"kiks.engine.physics.motor", "kiks.engine.sensing.camera", "kiks.batch.loop"} <= set(before)
    for changed, wanted in (("sensing.camera", "sensing.camera"), ("physics.collisions", "physics.collisions meeting")):
        name = f"kiks.engine.{changed}"
        after = code_cache._syntax(sources | {name: sources[name] + b"\ndef another(): pass\n"})
        differ = {each for each in before if before[each] != code_cache._digest(after[each].encode())[:16].decode()}
        assert differ == {f"kiks.engine.{each}" for each in wanted.split()}


def test_the_digests_of_the_sources_are_computed_once(tmp_path, monkeypatch):
    computed = []
    monkeypatch.setattr(code_cache, "_syntax", lambda sources: computed.append(1) or {"kiks.engine.step": "text"})
    digests = code_cache._digests.__wrapped__()
    (known,) = (tmp_path / "cache" / "kiks").glob("sources-*")
    text = known.read_bytes()
    known.write_bytes(text.replace(digests["kiks.engine.step"].encode(), b"0" * 16))
    assert code_cache._digests.__wrapped__() == {"kiks.engine.step": "0" * 16}
    assert len(computed) == 1
    known.write_bytes(b"..")
    assert code_cache._digests.__wrapped__() == digests
    assert len(computed) == 2
    assert known.read_bytes() == text


def test_code_that_calls_a_kernel_with_other_arguments_than_it_takes_is_compiled_again(monkeypatch):
    monkeypatch.setattr(code_cache, "_AT_LOAD", {"numba.dynamic": lambda: None})
    monkeypatch.setattr(code_cache, "_linked_in", lambda library: ["numba.dynamic"])
    assert [call(), call()] == [False, True]
    monkeypatch.setattr(code_cache, "_AT_LOAD", {})
    assert not call()


def test_kernels_in_a_file_have_names_of_their_own():
    for path in (Path(code_cache.__file__).parents[1]).rglob("*.py"):
        names = re.findall(r"^@(?:entry|linked.*)\ndef (\w+)", path.read_text(), re.M)
        assert len(names) == len(set(names))


@pytest.mark.usefixtures("kept", "another_version")
def test_another_version_has_a_folder_of_its_own():
    assert not is_compiled("double_of")


@pytest.mark.parametrize("home", ["/proc/none", "/dev/null/none", f"/tmp/{'n' * 300}"])
def test_without_a_home_it_is_among_temporary_files(home, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("NUMBA_CACHE_DIR", home)
    assert [call(), call(), call(0.5)] == [False, True, False]
    (line,) = [record.getMessage() for record in caplog.records]
    assert line.startswith(f"The compiled engine cannot be kept in '{home}/kiks/")
    assert "NUMBA_CACHE_DIR" in line
    (folder,) = (tmp_path / "temporary").iterdir()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_a_folder_that_others_can_write_to_is_not_used(kept, caplog):
    kept.unlink()
    kept.parent.chmod(0o777)
    assert [call(), call()] == [False, True]
    assert "(others may write there)" in caplog.text
    assert not kept.exists()


def test_on_a_full_disk_the_run_goes_on(tmp_path, caplog):
    with full_disk(1000):
        assert [call(), call(), call(0.5)] == [False] * 3
    (line,) = [record.getMessage() for record in caplog.records]
    assert "(File too large)" in line
    assert line.endswith("so each start compiles it. Set NUMBA_CACHE_DIR to a folder of yours with room.")
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.fixture
def shipped(kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a file with machine code, as a wheel brings it; the user's cache is empty."""
    monkeypatch.setattr(code_cache, "SHIPPED", tmp_path / "compiled")
    (tmp_path / "compiled").mkdir(0o700)
    return Path(shutil.move(kept.parent, tmp_path / "compiled")) / kept.name


def test_what_a_wheel_brings_is_used(shipped, tmp_path):
    assert is_compiled("double_of")
    assert call()
    assert files(tmp_path / "cache") == []
    assert [call(0.5), call(0.5)] == [False, True]
    assert files(shipped.parent) == [shipped]


@pytest.mark.usefixtures("shipped", "another_version")
def test_what_a_wheel_brings_for_another_version_is_quietly_ignored(caplog):
    assert not is_compiled("double_of")
    assert [call(), call()] == [False, True]
    assert not caplog.records


@pytest.mark.parametrize("right", [0, 0o020, 0o002])
@pytest.mark.parametrize("is_folder", [False, True])
def test_what_is_damaged_or_others_can_write_in_a_wheel_stays_and_is_quietly_ignored(right, is_folder, shipped, caplog):
    path = shipped.parent if is_folder else shipped
    path.chmod(stat.S_IMODE(path.stat().st_mode) | right)
    if not right:
        shipped.write_bytes(flipped(shipped.read_bytes(), 1))
    before = shipped.read_bytes()
    assert [call(), call()] == [False, True]
    assert shipped.read_bytes() == before
    assert not caplog.records


def test_a_user_without_a_home(monkeypatch, tmp_path):
    def lost() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", lost)
    assert [call(), call()] == [False, True]
    assert [path.parent.parent for path in files(tmp_path)] == [tmp_path / "temporary"]
