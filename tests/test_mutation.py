"""The table of planted faults: each can be planted, its near tests are there, and each folder of KiKS has one."""

from pathlib import Path

from tools.mutation import load_faults

ROOT = Path(__file__).parents[1]
SOURCES = {".py", ".js", ".toml", ".json"}


def test_each_fault_can_be_planted_and_each_folder_has_one() -> None:
    faults = load_faults()
    for fault in faults:
        assert (ROOT / fault.file).read_text(encoding="utf-8").count(fault.old) == 1, fault.name
        assert fault.near(ROOT) == list(fault.tests), fault.name
    assert len({fault.name for fault in faults}) == len(faults)
    files = [file.relative_to(ROOT) for file in ROOT.glob("src/kiks/**/*") if file.suffix in SOURCES]
    folders = {file.parent for file in files if "compiled" not in file.parts} | {Path("matlab")}
    assert folders <= {Path(fault.file).parent for fault in faults}
