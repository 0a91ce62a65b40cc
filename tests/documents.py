"""Does what a page shows: runs its blocks one after the other in one folder, and compares what they print."""

import functools
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple, get_args

from tests import forked
from tests.matlab.terminal import Terminal

ROOT = Path(__file__).parents[1]

_BLOCK = re.compile(
    r"(?:^ *<!-- not run: (?P<reason>.+?) -->\n+)?"
    r"^(?P<indent> *)```(?P<language>[^\s`]*).*\n(?P<code>(?:.*\n)*?)(?P=indent)```$",
    flags=re.MULTILINE,
)


class Block(NamedTuple):
    """A block of a page.

    Attributes:
        language: What stands behind its fence.
        code: Its lines.
        reason: Why it is not run: what the comment `<!-- not run: it needs a robot -->` before it says.
    """

    language: str
    code: str
    reason: str | None


@functools.cache
def blocks(page: Path) -> list[Block]:
    """Return the blocks of a page, but not the directives of the site, which `make docs` reads."""
    text = page.read_text(encoding="utf-8")
    found = [
        Block(each["language"], re.sub(f"^{each['indent']}", "", each["code"], flags=re.MULTILINE), each["reason"])
        for each in _BLOCK.finditer(text)
    ]
    assert 2 * len(found) == len(re.findall(r"^ *```", text, flags=re.MULTILINE)), f"{page.name}: a fence is too many"
    return [each for each in found if each.language not in ("{include}", "{toctree}", "{eval-rst}")]


class Reader:
    """A person who types what pages show.

    Args:
        folder: Where it is typed.
        installed: The folder of commands of an environment with KiKS; None for that of the tests, which starts faster.
        is_short: Whether evolutions and matches are shorter than the pages say.
    """

    def __init__(self, folder: Path, installed: Path | None = None, *, is_short: bool = True) -> None:
        self.folder, self._installed, self._printed = folder, installed, ""
        self._octave: list[str] = []
        self._saved = folder
        commands = folder / ".commands"
        links = commands / "links"
        links.mkdir(parents=True, mode=0o700)
        kiks = forked.kiks_command() if installed is None else [str(installed / "kiks")]
        shown = [sys.executable, "-I", "-S", str(ROOT / "tests" / "programs" / "shown_kiks.py"), shlex.join(kiks)]
        shown.append("short" if is_short else "whole")
        self._python = sys.executable if installed is None else str(installed / "python")
        for name, words in {"kiks": shown, "python": [self._python]}.items():
            (commands / name).write_text(f'#!/bin/sh\nexec {shlex.join(words)} "$@"\n')
            (commands / name).chmod(0o755)
        self._environment = {
            "PATH": f"{commands}{os.pathsep}{os.environ['PATH']}",
            "KIKS_COMMAND": shlex.join(kiks),
            "XDG_RUNTIME_DIR": str(links),
            "MPLBACKEND": "agg",
        }

    def read(self, page: Path) -> None:
        """Do what a page shows."""
        for block in blocks(page):
            if block.reason is None:
                getattr(self, f"do_{block.language}")(block.code)
        self._run_octave()

    def do_python(self, code: str) -> None:
        """Run a program, or save one that is for `kiks run`; its first line is its name."""
        if "\nimport serial\n" in code and (named := re.match(r"# (\w+\.py)\n", code)):
            self.save_at(self.folder / named[1])
            self._saved.write_text(code, encoding="utf-8")
            return
        if self._installed is None:
            result = forked.run(code=code, cwd=self.folder, env=self._environment)
        else:
            result = self._run(self._python, "-c", code)
        assert result.returncode == 0, result.stderr
        self._printed = result.stdout

    def save_at(self, path: Path) -> None:
        """Take a file for the one that was saved last."""
        self._saved = path

    def do_diff(self, code: str) -> None:
        """Change the program that was saved last: lines with + are new, those with - go."""
        before, after = (
            "".join(line[1:] for line in code.splitlines(keepends=True) if line[0] != sign) for sign in "+-"
        )
        text = self._saved.read_text(encoding="utf-8")
        assert text.count(before) == 1, f"{before!r} must stand once in {text!r}"
        self._saved.write_text(text.replace(before, after), encoding="utf-8")

    def do_console(self, code: str) -> None:
        """Type what stands behind the prompts of pdb at a terminal, and compare what comes; ... stands for any text."""
        command, talk = code.removeprefix("$ kiks ").split("\n", 1)
        first, *talk = re.split(r"^(\(Pdb\) .*\n)", talk, flags=re.MULTILINE)
        words = [self._python, "-m", "kiks", *shlex.split(command)]
        with Terminal(self.folder, {"TERM": "dumb"}, command=words) as terminal:
            awaited = first
            for prompt, answer in zip(talk[::2], talk[1::2], strict=True):
                terminal.wait_for(r"\A" + _pattern_of(f"{awaited}(Pdb) "))
                typed = prompt.removeprefix("(Pdb) ")
                terminal.type(typed.rstrip("\n"))
                awaited = typed + answer
            terminal.wait_for(r"\A" + _pattern_of(awaited))

    def do_sh(self, code: str) -> None:
        # What stands in /tmp in a page has a place of its own here.
        result = self._run("bash", "-euo", "pipefail", "-c", code.replace("/tmp/", f"{self.folder}/"))
        self._printed = result.stdout + result.stderr
        assert result.returncode == 0, f"{code}{self._printed}"

    def _run(self, *words: str) -> subprocess.CompletedProcess[str]:
        command = ["timeout", "-s", "KILL", str(forked.LIMIT_S), *words]
        environment = os.environ | self._environment
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)

    def do_octave(self, code: str) -> None:
        """Keep what one process shall do together with the next blocks of Octave."""
        self._octave.append(code)

    do_matlab = do_octave

    def _run_octave(self) -> None:
        if self._octave:
            # `kiks matlab` prints what tells Octave where the toolbox is.
            self.do_sh(f'octave-cli --no-gui -qf --eval "$(kiks matlab)" --eval {shlex.quote("".join(self._octave))}')
            self._octave.clear()

    def do_json(self, code: str) -> None:
        json.loads(code)

    def do_toml(self, code: str) -> None:
        """Check a file, or a part of one, by the schemas; what must be in it may be in another part."""
        import jsonschema

        from kiks.cli.schema import FileKind, schema_of

        validators = [jsonschema.Draft202012Validator(schema_of(kind)) for kind in get_args(FileKind)]
        found = [
            [error.message for error in each.iter_errors(tomllib.loads(code)) if error.validator != "required"]
            for each in validators
        ]
        assert [] in found, f"{code}is of no kind: {found}"

    def do_text(self, code: str) -> None:
        """Compare what the block before has printed; ... stands for any text."""
        self._run_octave()
        for line in code.splitlines():
            assert re.search(f"^{_pattern_of(line)}$", self._printed, flags=re.MULTILINE), (
                f"{line!r} is not in {self._printed!r}"
            )


def _pattern_of(shown: str) -> str:
    """Return what matches a text of a page, as it is or at a terminal."""
    return re.escape(shown).replace(r"\.\.\.", ".*").replace("\\\n", r"\r?\n")
