"""An avoider that sends a line only after the answer to the last one, and compares answers with texts, as Elib does.

Argument: the way. Its texts are those of BTcom 1.1.3 (epuck-protocol.md 7).
"""

import sys
import time

from epuck_line import Line

TEXTS = {
    **{letter: f"{letter.lower()}\r\n" for letter in "BDFJLPS"},
    "K": "k, Starting calibration - Remove any object in sensors range\r\nk, Calibration finished\r\n",
    "R": 'r\r\f\aWELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n',
    "V": "v,Version 1.1.3 September 2006\r\n",
}
line = Line(sys.argv[1], 5.0)


def ask(command):
    line.send(command.encode() + b"\r")
    expected = TEXTS.get(command[0])
    answer = line.lines(expected.count("\n") if expected else 1).decode()
    if answer != expected and not (expected is None and answer.startswith(command[0].lower())):
        sys.exit(f"{command}: {answer!r} in place of {expected!r}")
    return [int(number) for number in answer.split(",")[1:]] if expected is None else answer


for command in ("R", "V", "K", "B,1", "F,1", "L,8,1", "P,0,0", "J,0,20,20,4"):
    ask(command)
print(time.time())
for _ in range(80):
    values = ask("N")
    left, right = values[7] + values[6] // 2, values[0] + values[1] // 2
    ask(f"D,{max(-1000, 500 - right)},{max(-1000, 500 - left)}")
print(ask("N"), ask("Q"), ask("A"), ask("E"), ask("M"), ask("O"), ask("U"), ask("C"), ask("I"))
line.send(b"\xb7\0")
head = line.exactly(3)
print(tuple(head), len(line.exactly(head[1] * head[2])))
ask("S")
print(time.time())
line.close()
