"""What sphinx-gallery runs: the scripts of `examples/gallery`, an entry for each demonstration and each exercise."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

from kiks.cli.examples import first_program
from kiks.model.project import Project
from kiks.model.shipped import demonstrations

ROOT = Path(__file__).parents[2]
SOURCE, PAGES = ROOT / "build" / "gallery", "gallery"
"""Where scripts run, and leave recordings and pictures, and the folder of the pages."""

HEADS = {
    "": (
        "Gallery",
        "Short scripts and demonstrations. Each has run while this site was built, and made its pictures. "
        "``kiks examples OUT`` copies them into a folder of yours, to be changed.",
    ),
    "scripts": ("Scripts", "``python FILE.py`` runs one: it prints a result and leaves its pictures."),
    "demonstrations": (
        "Demonstrations",
        "Programs for pyserial, which know nothing of the simulation. ``kiks demo NAME`` runs one, "
        "``kiks demo NAME --desk`` shows it in the browser.",
    ),
    "exercises": (
        "Exercises",
        "Write a program that reaches the goal in every case: from other starts, on slow computers, with robots that "
        "differ. ``kiks desk examples/exercises/NAME`` opens one, with its text, hints, and a program to begin with.",
    ),
}

DEMONSTRATION = '''"""
{title}
{line}

{text}

.. literalinclude:: /../{path}
   :start-at: import
   :caption: {path}
"""

# %%
# ``kiks demo {name} --desk`` shows it in the browser. Without ``--desk`` it leaves a picture:

import subprocess

run = subprocess.run(["kiks", "demo", "{name}"], capture_output=True, text=True, check=True)
print(run.stdout + run.stderr)
'''


EXERCISE = '''"""
{title}
{line}

**{goal}.** {cases}

.. literalinclude:: /../{path}/template.py
   :caption: The program to begin with
"""

# %%
# ``kiks desk {path}`` opens it. The room, and where the first program has led the robot:

import subprocess

folder = "../../../{path}"
command = ["kiks", "run", "--export", "exercise_{name}.png", folder, f"{{folder}}/template.py"]
run = subprocess.run(command, capture_output=True, text=True, check=True)
print(run.stdout + run.stderr)
'''


def prepare() -> None:
    """Lay the scripts out as sphinx-gallery reads them, and let them find the command `kiks`."""
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    shutil.rmtree(SOURCE, ignore_errors=True)
    for folder, (title, text) in HEADS.items():
        (SOURCE / folder).mkdir(parents=True, exist_ok=True)
        line = ("-" if folder else "=") * len(title)
        (SOURCE / folder / "GALLERY_HEADER.rst").write_text(f"{title}\n{line}\n\n{text}\n")
    for path in (ROOT / "examples" / "gallery").glob("*.py"):
        shutil.copy(path, SOURCE / "scripts")
    for name, project in demonstrations().items():
        (SOURCE / "demonstrations" / f"{name}.py").write_text(entry(name, project))
    for path in (ROOT / "examples" / "exercises").glob("*/exercise.kiks"):
        name, folder = path.parent.name, path.parent
        (SOURCE / "exercises" / f"exercise_{name}.py").write_text(exercise_entry(name, folder))


def exercise_entry(name: str, folder: Path) -> str:
    """Return the script of an exercise, which shows its goal and its room."""
    project = Project.load(folder)
    assert project.exercise is not None
    assert project.goal is not None
    shown = ", ".join(dict.fromkeys(table.name for table in project.cases if not table.is_hidden))
    title = project.exercise.title
    return EXERCISE.format(
        title=title,
        line="=" * len(title),
        goal=project.goal.text,
        cases=f"It is tried in these cases, and in some that you do not see: {shown}.",
        name=name,
        path=folder.relative_to(ROOT),
    )


def entry(name: str, path: Path) -> str:
    """Return the script of a demonstration, which shows its program and runs it."""
    program, text = first_program(path)
    title = name.replace("_", " ").capitalize()
    return DEMONSTRATION.format(
        title=title, line="=" * len(title), text=text, name=name, path=program.relative_to(ROOT)
    )


def keep_pictures(block: Any, variables: dict[str, Any], settings: dict[str, Any]) -> str:
    """Return the pictures that a script has written, in that order, as its page shows them."""
    script = Path(variables["src_file"])
    pictures = (path for path in script.parent.iterdir() if path.suffix in (".png", ".webp"))
    made = (path for path in pictures if maker_of(path) == script.stem)
    kept = []
    for path in sorted(made, key=lambda path: path.stat().st_mtime_ns):
        place = Path(next(variables["image_path_iterator"])).with_suffix(path.suffix)
        kept.append(str(shutil.move(path, place)))
    return figure_rst(kept, settings["src_dir"], script.stem.replace("_", " "))


def maker_of(picture: Path) -> str:
    """Return the script whose name that of a picture holds: another one may be writing its own beside it."""
    names = (script.stem for script in picture.parent.glob("*.py"))
    return max((name for name in names if name in picture.stem), key=len, default="")
