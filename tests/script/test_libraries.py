"""Libraries whose code in C waits by itself: under `kiks run` they wait in simulated time."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests import forked
from tests.at_length import cases
from tests.script.conftest import programs_of
from tests.served import PROGRAMS, called

pytestmark = pytest.mark.slow

IN_WINDOWS = programs_of("""
=== windows of Tk live in simulated time
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
> first 0.1
> second 0.3
> from a thread 0.5
> quit 1.0
> variable 1.5
> slept 2.0
> window 2.25
> over 2.5
=== clocks of pygame are simulated
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
> 1200 25 300
> [1700, 1900, 2100] True 2600
=== plots pause in simulated time
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
> 1.0
> 10 True
=== an error in a call of Tk is told and no more
import tkinter
root = tkinter.Tk()
root.after(1, lambda: 1 / 0)
root.after(9, root.destroy)
root.mainloop()
""")

ON_TERMINAL = programs_of("""
=== curses
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
""")


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
            sdl = {"SDL_AUDIODRIVER": "dummy", "SDL_VIDEODRIVER": "dummy", "PYGAME_HIDE_SUPPORT_PROMPT": "1"}
            yield {"DISPLAY": f":{number}", **sdl}
        finally:
            process.terminate()


@pytest.mark.parametrize("claim", cases(IN_WINDOWS, 2))
def test_program_with_windows(claim: str, tmp_path: Path, screen: dict[str, str]) -> None:
    program, printed = IN_WINDOWS[claim]
    (tmp_path / "program.py").write_text(program)
    done = forked.run("run", "program.py", cwd=tmp_path, env=screen)
    assert (done.returncode, done.stdout) == (0, printed), done.stderr
    assert ("Exception in Tkinter callback" in done.stderr) == ("error" in claim)
    if "windows" in claim:
        assert forked.run("run", "program.py", cwd=tmp_path, env=screen).stderr == done.stderr, "nor is it repeatable"


def on_terminal(folder: Path, name: str) -> tuple[int, str]:
    """Run a program on a terminal without input; return its exit code, and what it and KiKS have said."""
    (folder / "program.py").write_text(ON_TERMINAL[name][0])
    words = [*forked.kiks_command(), "run", str(folder / "program.py")]
    done = called(sys.executable, PROGRAMS / "on_terminal.py", *words)
    return done.returncode, done.stdout


def test_waits_of_curses_are_simulated(tmp_path: Path) -> None:
    code, said = on_terminal(tmp_path, "curses")
    assert code == 0
    assert said.startswith("[0.25, 0.5, 1.0]\n")
