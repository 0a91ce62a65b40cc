"""Folders of temporary recordings: of a process that was killed they go, and no other."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import pytest

from kiks.recording.temporary_folder import PREFIX, TemporaryFolder

PROCESS = """
import sys
from kiks.recording.temporary_folder import TemporaryFolder
folder = TemporaryFolder()
(folder.path / "1.mcap").write_bytes(b"recording")
print(folder.path, flush=True)
sys.stdin.read()
"""

THREADS, ROUNDS = 8, 40


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let temporary files lie in a folder of the test, also those of its processes."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


def process_with_folder() -> tuple[subprocess.Popen[str], Path]:
    """Start a process that has a folder, and return both."""
    process = subprocess.Popen(
        [sys.executable, "-c", PROCESS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_a_killed_process_leaves_a_folder_that_the_next_one_deletes(temporary: Path) -> None:
    (killed, abandoned), (living, kept) = process_with_folder(), process_with_folder()
    with killed, living:
        killed.kill()
        killed.wait()
        assert (abandoned / "1.mcap").exists()
        own = TemporaryFolder()
        assert not abandoned.exists()
        assert (kept / "1.mcap").exists()
        living.communicate("")
    assert list(temporary.iterdir()) == [own.path]
    TemporaryFolder().delete()
    assert own.path.exists()
    own.delete()
    assert not list(temporary.iterdir())


def test_links_files_and_folders_of_others_stay(
    temporary: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "target"
    target.mkdir()
    (target / "thesis.txt").write_text("years of work")
    (temporary / f"{PREFIX}link").symlink_to(target)
    (temporary / f"{PREFIX}file").write_text("no folder")
    (temporary / f"{PREFIX}inside").mkdir()
    (temporary / f"{PREFIX}inside" / "link").symlink_to(target)
    before = sorted(temporary.iterdir())
    with monkeypatch.context() as other_user:
        other_user.setattr(os, "geteuid", lambda: os.getuid() + 1)
        TemporaryFolder().delete()
        assert sorted(temporary.iterdir()) == before
    TemporaryFolder().delete()
    assert not (temporary / f"{PREFIX}inside").exists()
    assert (temporary / f"{PREFIX}link").is_symlink()
    assert (temporary / f"{PREFIX}file").exists()
    assert (target / "thesis.txt").exists()


def test_of_many_that_begin_at_once_none_deletes_another(temporary: Path) -> None:
    failed: list[BaseException] = []

    def begin_often() -> None:
        try:
            for _ in range(ROUNDS):
                folder = TemporaryFolder()
                file = folder.path / "1.mcap"
                file.write_bytes(b"recording")
                TemporaryFolder().delete()
                assert file.read_bytes() == b"recording"
                folder.delete()
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=begin_often) for _ in range(THREADS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    assert not list(temporary.iterdir())


def test_a_folder_needs_no_locks(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(_file: int, _how: int) -> None:
        raise OSError("no locks available")

    monkeypatch.setattr("fcntl.flock", none)
    one, other = TemporaryFolder(), TemporaryFolder()
    assert one.path.exists()
    one.delete()
    other.delete()
