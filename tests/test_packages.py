"""What is published: an archive with all sources, a wheel with all its parts, and the same version everywhere."""

import email.message
import email.parser
import re
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest
import yaml
from tests.at_length import at_length
from tests.documents import Reader, blocks
from tests.matlab.octave import needs_octave
from tests.wheels import ROOT, build, install

import kiks

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def metadata(wheel: Path) -> email.message.Message:
    """Return what a package index reads."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith("/METADATA"))
        return email.parser.Parser().parsestr(archive.read(name).decode())


def tracked() -> set[str]:
    """Return the files of the repository, with those that are new, but not those that git ignores."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    return {name for name in listed if (ROOT / name).is_file()}


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="git knows the files of a clone only")
def test_the_archive_of_the_sources_holds_all_of_them(tmp_path: Path) -> None:
    with tarfile.open(build(tmp_path, "-t", "sdist")) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert inside == {"PKG-INFO"} | tracked()


def test_a_wheel_holds_the_toolbox_and_the_examples(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = set(archive.namelist())
    for here, there in {"src/kiks": "kiks", "matlab": "kiks/matlab", "examples": "kiks/examples"}.items():
        files = {path.relative_to(ROOT / here) for path in (ROOT / here).rglob("*") if path.is_file()}
        wanted = {f"{there}/{path.as_posix()}" for path in files if path.suffix != ".pyc"}
        assert wanted <= inside, sorted(wanted - inside)[:5]


def test_an_installed_wheel_runs_programs_in_an_empty_folder(wheel: Path, tmp_path: Path) -> None:
    reader = Reader(tmp_path, install(wheel, tmp_path / "venv"))
    reader.do_sh("kiks demo; kiks examples examples; kiks run examples/programs/wander.py")
    code = next(block.code for block in blocks(ROOT / "README.md") if block.language == "python")
    reader.do_python(f"import kiks; assert 'venv' in kiks.__file__\n{code}")


@at_length
@needs_octave
def test_the_readme_is_true_for_a_wheel_in_an_empty_folder(wheel: Path, tmp_path: Path) -> None:
    reader = Reader(tmp_path, install(wheel, tmp_path / "venv"))
    reader.read(ROOT / "docs" / "index.md")  # three things to try, which copy the examples
    reader.read(ROOT / "README.md")


def test_the_readme_of_a_package_needs_no_files_beside_it(metadata: email.message.Message) -> None:
    text = metadata.get_payload()
    assert isinstance(text, str)
    targets = re.findall(r"\]\(([^)]+)\)", text)
    source = dict(line.split(", ") for line in metadata.get_all("Project-URL", []))["Source"]
    assert len(targets) > 20
    for target in targets:
        base, _, path = target.partition(f"/v{kiks.__version__}/")
        assert base in (f"{source}/blob", f"{source}/raw")
        assert (ROOT / path.partition("#")[0]).exists()


def test_all_places_have_the_same_version(metadata: email.message.Message) -> None:
    assert metadata["Version"] == kiks.__version__
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.findall(r"^## (\S+)(?: \((.+)\))?$", changes, re.MULTILINE)
    assert versions[0][0] == kiks.__version__.partition(".dev")[0]
    released = next((version, day) for version, day in versions if day)
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert (cited["version"], cited["date-released"].isoformat()) == released
