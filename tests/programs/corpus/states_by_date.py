"""A state machine whose transitions are dated with `datetime`: drive, turn, go back, rest."""

import sys
from datetime import datetime, timedelta
from enum import Enum, auto

import serial


class State(Enum):
    DRIVE = auto()
    TURN = auto()
    BACK = auto()
    REST = auto()
    END = auto()


PLAN = {
    State.DRIVE: (b"D,5,5\n", 0.6, State.TURN),
    State.TURN: (b"D,-4,4\n", 0.5, State.BACK),
    State.BACK: (b"D,-5,-5\n", 0.6, State.REST),
    State.REST: (b"D,0,0\n", 0.3, State.END),
}

with serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS0", 9600, timeout=1) as ser:
    state, since = State.DRIVE, datetime.min
    diary = []
    start = datetime.now()
    while state is not State.END:
        command, seconds, following = PLAN[state]
        if since == datetime.min:
            ser.write(command)
            ser.readline()
            since = datetime.now()
            diary.append((state, since))
        ser.write(b"N\n")
        front = max(int(value) for value in ser.readline().split(b",")[3:5])
        if datetime.now() - since > timedelta(seconds=seconds) or (state is State.DRIVE and front > 1000):
            state, since = following, datetime.min

for (state, entered), (_, left) in zip(diary, [*diary[1:], (None, datetime.now())]):
    lasted = (left - entered).total_seconds()
    print(f"{state.name:6} {PLAN[state][1] if -0.05 < lasted - PLAN[state][1] < 10 else round(lasted, 1)}")
print("dates in order:", diary == sorted(diary, key=lambda entry: entry[1]), start <= diary[0][1])
