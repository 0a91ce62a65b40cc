"""A state machine: look for a wall, turn along it, follow it, and begin anew when it is lost."""

import time
from enum import Enum

import serial


class State(Enum):
    SEARCH = "search"
    TURN = "turn"
    FOLLOW = "follow"


robot = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)


def ask(command):
    robot.write(command.encode() + b"\n")
    return [int(word) for word in robot.readline().split(b",")[1:]]


def next_state(state, readings):
    ahead, beside = max(readings[1:5]), readings[5]
    if state is State.SEARCH and ahead > 300:
        return State.TURN
    if state is State.TURN and ahead < 150:
        return State.FOLLOW
    if state is State.FOLLOW:
        if ahead > 400:
            return State.TURN
        if beside < 30:
            return State.SEARCH
    return state


state, begin_s = State.SEARCH, time.time()
while time.time() - begin_s < 60:
    readings = ask("N")
    new = next_state(state, readings)
    if new is not state:
        print(f"{time.time() - begin_s:5.1f} s: {state.value} -> {new.value}")
        state = new
    if state is State.SEARCH:
        ask("D,6,6")
    elif state is State.TURN:
        ask("D,-3,3")  # to the left, so that the wall comes to the right
    else:
        turn = max(-2, min(2, (readings[5] - 300) // 100))
        ask(f"D,{5 - turn},{5 + turn}")
ask("D,0,0")
