"""Libraries whose code in C waits by itself: under `kiks run` they wait in simulated time."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from tests.at_length import at_length
from tests.cli.test_cli import KIKS
from tests.guard import GUARD_S
from tests.served import PROGRAMS

pytestmark = pytest.mark.slow


TK = """
import threading, time, tkinter
def note(what): print(what, round(time.monotonic(), 3))
root = tkinter.Tk()
root.after(300, note, 'second')
root.after(100, note, 'first')
root.after_cancel(root.after(200, note, 'never'))
def work():
    time.sleep(0.5)
    root.after(0, note, 'from a thread')
    time.sleep(0.5)
    root.after(0, root.quit)
threading.Thread(target=work).start()
root.mainloop()
note('quit')
variable = tkinter.IntVar(root)
root.after(500, variable.set, 1)
root.wait_variable(variable)
note('variable')
root.after(500)
note('slept')
window = tkinter.Toplevel(root)
root.after(250, window.destroy)
root.wait_window(window)
note('window')
root.after(250, root.destroy)
tkinter.mainloop()
note('over')
"""

TK_SAYS = """\
first 0.1
second 0.3
from a thread 0.5
quit 1.0
variable 1.5
slept 2.0
window 2.25
over 2.5
"""

PYGAME = """
import pygame, time
pygame.init()
pygame.display.set_mode((64, 64))
clock, start = pygame.time.Clock(), pygame.time.get_ticks()
for frame in range(30):
    clock.tick(25)
print(pygame.time.get_ticks() - start, round(clock.get_fps()), pygame.time.wait(300))
kind = pygame.event.custom_type()
pygame.event.clear()
pygame.time.set_timer(kind, 200, 3)
rings = []
while len(rings) < 3:
    if pygame.event.wait().type == kind:
        rings.append(pygame.time.get_ticks() - start)
print(rings, pygame.event.wait(500).type == pygame.NOEVENT, pygame.time.get_ticks() - start)
"""

PYGAME_SAYS = "1200 25 300\n[1700, 1900, 2100] True 2600\n"

CURSES = """
import curses, time
def main(screen):
    times = []
    def note(): times.append(round(time.monotonic(), 3))
    screen.timeout(250)
    assert screen.getch() == -1
    note()
    screen.nodelay(True)
    assert screen.getch() == -1
    curses.napms(250)
    note()
    curses.halfdelay(5)
    window = curses.newwin(3, 3)
    assert window.getch() == -1
    note()
    curses.ungetch('k')
    screen.timeout(-1)
    assert screen.getkey() == 'k'
    return times
print(curses.wrapper(main))
"""

PLOT = """
import matplotlib, time
matplotlib.use("TkAgg")
import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation
figure, axes = plt.subplots()
for _ in range(4):
    plt.pause(0.25)
print(round(time.monotonic(), 1))
frames = []
def draw(number):
    frames.append(number)
    if len(frames) == 10:
        plt.close(figure)
    return []
animation = FuncAnimation(figure, draw, interval=100, cache_frame_data=False)
plt.show()
print(len(frames), 1.9 < time.monotonic() < 2.2)
"""

KEYBOARD = """
import threading, time
threading.Thread(target=time.sleep, args=(5,)).start()
input('Enter stops the robot. ')
"""


@pytest.fixture(scope="module")
def screen() -> Iterator[dict[str, str]]:
    """What programs find in their environment: a screen for windows and none for sound."""
    if shutil.which("Xvfb") is None:
        pytest.skip("there is no Xvfb for the program with a window")
    ours, theirs = os.pipe()
    command = ["Xvfb", "-displayfd", str(theirs), "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=[theirs], stderr=subprocess.DEVNULL) as process:
        os.close(theirs)
        try:
            with open(ours) as told:
                number = told.readline().strip()
            yield {**os.environ, "DISPLAY": f":{number}", "SDL_AUDIODRIVER": "dummy"}
        finally:
            process.terminate()


def run(folder: Path, text: str, environment: Mapping[str, str] | None = None, *before: str) -> tuple[int, str, str]:
    """Run a program by `kiks run`; return its exit code, and what it and KiKS have said."""
    path = folder / "program.py"
    path.write_text(text)
    done = subprocess.run(
        [*before, *KIKS, "run", str(path)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=GUARD_S,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


def on_terminal(folder: Path, text: str) -> tuple[int, str]:
    """Run a program on a terminal without keyboard input."""
    return run(folder, text, None, sys.executable, str(PROGRAMS / "on_terminal.py"))[:2]


def test_windows_of_tk_live_in_simulated_time(tmp_path: Path, screen: dict[str, str]) -> None:
    code, said, told = run(tmp_path, TK, screen)
    assert (code, said) == (0, TK_SAYS)
    assert told.endswith(run(tmp_path, TK, screen)[2].splitlines()[-1] + "\n")


@at_length
def test_error_in_a_call_of_tk_is_told_and_no_more(tmp_path: Path, screen: dict[str, str]) -> None:
    begin = "import tkinter\nroot = tkinter.Tk()\n"
    fails = f"{begin}root.after(1, lambda: 1 / 0)\nroot.after(9, root.destroy)\nroot.mainloop()\n"
    code, _, told = run(tmp_path, fails, screen)
    assert code == 0
    assert "Exception in Tkinter callback" in told


def test_clocks_of_pygame_are_simulated(tmp_path: Path, screen: dict[str, str]) -> None:
    code, said, _ = run(tmp_path, PYGAME, {**screen, "SDL_VIDEODRIVER": "dummy", "PYGAME_HIDE_SUPPORT_PROMPT": "1"})
    assert (code, said) == (0, PYGAME_SAYS)


def test_waits_of_curses_are_simulated(tmp_path: Path) -> None:
    code, said = on_terminal(tmp_path, CURSES)
    assert code == 0
    assert said.startswith("[0.25, 0.5, 1.0]\n")


@at_length
def test_plots_pause_in_simulated_time(tmp_path: Path, screen: dict[str, str]) -> None:
    code, said, told = run(tmp_path, PLOT, screen)
    assert (code, said) == (0, "1.0\n10 True\n"), told


def test_thread_that_waits_for_a_person_ends_the_program(tmp_path: Path) -> None:
    code, said = on_terminal(tmp_path, KEYBOARD)
    assert code == 1
    assert said.startswith(
        "kiks: a program in simulated time must not wait for the keyboard while other threads drive a"
    )
    code, said, _ = run(tmp_path, KEYBOARD)
    assert (code, said) == (1, "Enter stops the robot. ")
