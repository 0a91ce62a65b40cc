"""A program that runs for a day: a wall follower in Octave at 9600 baud, for 24 simulated hours without a pause.

Run: python benchmarks/long_run.py [--hours 24] [--pieces 24] [--json]. After each piece (an hour) it prints the memory
of Octave and of the session's process, the size of the robot's path and of the session's files, the speed, and the
processor time of both. The drift is the time by kiks_ktime less the time of all characters and replies by arithmetic:
11 bits a character, 1 ms a reply, and no thinking. It must be zero, and in the last piece memory and processor time
must be those of the second.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from calibration import report
from kiks.units import character_ns

MATLAB = Path(__file__).parent.parent / "matlab"

BAUD = 9600

PROGRAM = """
addpath('{matlab}');
global KIKS_THINKING KIKS_SEED KIKS_WINDOW
KIKS_THINKING = 'none'; KIKS_SEED = 1; KIKS_WINDOW = {window};
kiks();
ref = kiks_kopen([-1 {baud} 1]);
since = kiks_ktime(-1); now_s = since;
begin = builtin('tic'); characters = 0; replies = 0; loops = 0;
for piece = 1:{pieces}
    while now_s < piece * {piece_s}
        reply = kiks_ksend(['N' 10], ref);
        s = sscanf(reply(3:end), '%d,');
        ahead = max(s(3:4)) / 5 + max(0, s(2) - 400) / 5;
        side = max(-2.8, min(5, (max(s(1:2)) - 400) / 50));
        speed = round(max(-6, min(9, 5 + [1 -1] * (side + ahead))));
        command = sprintf('D,%d,%d\\n', speed);
        answer = kiks_ksend(command, ref);
        % A reply has lost its line end, which is a carriage return and a line feed.
        characters = characters + 2 + numel(reply) + 2 + numel(command) + numel(answer) + 2;
        replies = replies + 2;
        loops = loops + 1;
        now_s = kiks_ktime(-1);
    end
    drift_s = now_s - since - characters * {character_s} - replies * 1e-3;
    points = columns(kiks_siminfo_robotpath);
    printf('piece %d %.9f %.9f %d %g\\n', loops, now_s, drift_s, points, builtin('toc', begin));
    fflush(stdout);
    begin = builtin('tic');
    % Reading the path has let time pass.
    since = since - now_s;
    now_s = kiks_ktime(-1);
    since = since + now_s;
end
kiks_kclose(ref); kiks_quit
"""


def resident_mb(number: int) -> float:
    """Return the memory of a process [MB]."""
    words = Path(f"/proc/{number}/statm").read_text(encoding="ascii").split()
    return int(words[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def processor_s(*numbers: int) -> float:
    """Return the processor time that processes have had [s]: the same on a busy computer."""
    stats = [Path(f"/proc/{number}/stat").read_text(encoding="ascii").rpartition(")")[2].split() for number in numbers]
    return sum(int(words[11]) + int(words[12]) for words in stats) / os.sysconf("SC_CLK_TCK")


def files_mb(number: int, folder: Path) -> float:
    """Return the size of the files that a process has open, and of those in a folder [MB]."""
    opened = {path.resolve() for path in Path(f"/proc/{number}/fd").iterdir()}
    there = {path for path in folder.rglob("*") if path.is_file()} | {path for path in opened if path.is_file()}
    return sum(path.stat().st_size for path in there) / 1e6


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--hours", type=float, default=24.0, help="simulated hours")
    arguments.add_argument("--pieces", type=int, default=24, help="number of pieces that are reported")
    arguments.add_argument("--window", action="store_true", help="show the world on a desk, at full speed")
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    options = arguments.parse_args()
    octave = shutil.which("octave-cli")
    if octave is None:
        sys.exit("benchmarks/long_run.py needs Octave: apt-get install octave")
    piece_s = options.hours * 3600 / options.pieces
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = folder / "measure.m"
        program.write_text(
            PROGRAM.format(
                matlab=MATLAB,
                baud=BAUD,
                window=int(options.window),
                pieces=options.pieces,
                piece_s=piece_s,
                character_s=f"{character_ns(BAUD)}e-9",
            )
        )
        own = {"KIKS_COMMAND": f"{sys.executable} -m kiks", "BROWSER": "true", "TMPDIR": name}
        with subprocess.Popen(
            [octave, "--no-gui", "-qf", str(program)],
            stdout=subprocess.PIPE,
            text=True,
            cwd=folder,
            env={**os.environ, **own},
        ) as running:
            assert running.stdout is not None
            print(
                "   hours  Octave MB  session MB  files MB  path points  x real time  processor s/h      drift s",
                file=sys.stderr,
            )
            rows: list[tuple[float, ...]] = []
            earlier_s = 0.0
            for line in running.stdout:
                word, *numbers = line.split()
                if word != "piece":
                    print(line, end="", file=sys.stderr)
                    continue
                _, now_s, drift_s, points, real_s = map(float, numbers)
                session = int(Path(f"/proc/{running.pid}/task/{running.pid}/children").read_text().split()[0])
                had_s = processor_s(running.pid, session)
                row = (
                    now_s / 3600,
                    resident_mb(running.pid),
                    resident_mb(session),
                    files_mb(session, folder),
                    points,
                    piece_s / real_s,
                    (had_s - earlier_s) / (piece_s / 3600),
                    drift_s,
                )
                earlier_s = had_s
                rows.append(row)
                print(
                    "{:8.2f} {:10.1f} {:11.1f} {:9.1f} {:12.0f} {:12.1f} {:14.1f} {:12.9f}".format(*row),
                    file=sys.stderr,
                )
        if len(rows) < options.pieces:
            sys.exit("The program did not reach its end.")
    first, last = rows[min(1, len(rows) - 1)], rows[-1]
    report(
        [
            ("long_run.hours", last[0], "simulated hours"),
            ("long_run.octave_growth", last[1] - first[1], "MB since the second piece"),
            ("long_run.session_growth", last[2] - first[2], "MB since the second piece"),
            ("long_run.files", last[3], "MB at the end"),
            ("long_run.processor_last_over_second", last[6] / first[6], "of the second piece's processor time"),
            ("long_run.drift_us", max(abs(row[7]) for row in rows) * 1e6, "us, the largest"),
        ],
        as_json=options.json,
    )


if __name__ == "__main__":
    main()
