"""Functions of users stay within their arrays, or one line says which line leaves which array."""

import re
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.learn.small import refused

import kiks
from kiks.errors import KiksError, ParameterError

ROOM = kiks.Arena.box(600, 600)
SLOW_AHEAD = [4.0, 4.0] + [0.0] * 16


def values_of(controller: Any, parameters: Any, measures: Any = (kiks.measures.path_mm,)) -> Any:
    return kiks.Batch(ROOM, worlds=4, seed=1).run(controller, parameters, seconds=0.5, measures=measures).values


@numba.njit
def third(numbers, of):
    return numbers[of + 2]


elsewhere = ModuleType("elsewhere")
elsewhere.third = third  # type: ignore[attr-defined]


@kiks.controller(parameters=1)
def slips(sensors, memory, parameters, wheels):
    which = int(parameters[0])
    if which == 0:
        memory[0] += 1.0
    elif which == 1:
        for k in range(9):
            wheels[0] += sensors[k]
    elif which == 2:
        w = wheels
        w[-3] = 1.0
    elif which == 3:
        wheels[50_000_000] = 1.0
    elif which == 4:
        wheels[0] = third(parameters, 0)
    elif which == 5:
        wheels[0] = elsewhere.third(parameters, 0)
    elif which == 6:
        raise ValueError("nothing to do")
    else:
        wheels[:] = sensors


@kiks.controller(parameters=1)
def second_parameter(s, m, p, w):
    w[0] = p[1]


@kiks.controller(parameters=1)
def returns(sensors, memory, parameters, wheels):
    return (5.0, 5.0)


@kiks.controller(parameters=1)
def misspells(sensors, memory, parameters, wheels):
    wheels[0] = 1.0
    wheels[1] = sensors.mena()


@kiks.controller(parameters=1)
def opens_a_file(sensors, memory, parameters, wheels):
    with open("notes.txt") as file:
        wheels[0] = len(file.read())


@pytest.mark.parametrize(
    ("controller", "number", "words"),
    [
        (slips, 0, r"memory\[0\] \+= 1.0\) leaves memory, which has 0 numbers. Write @kiks.controller\(memory=1\)"),
        (slips, 1, r"\+= sensors\[k\]\) leaves sensors, which has 8 numbers"),
        (slips, 2, r"w\[-3\] = 1.0\) leaves wheels, which has 2 numbers"),
        (slips, 3, "leaves wheels"),
        (slips, 4, r"return numbers\[of \+ 2\]\) leaves numbers"),
        (slips, 5, r"return numbers\[of \+ 2\]\) leaves numbers"),
        (slips, 6, r'raise ValueError\("nothing to do"\)\): ValueError: nothing to do'),
        (slips, 7, "ValueError: cannot assign slice"),
        (second_parameter, 1, r"p\[1\]\) leaves p, which has 1 number. Write @kiks.controller\(parameters=2\)"),
        (returns, 1, "it returns something, where it must write into its arguments"),
        (misspells, 1, r"wheels\[1\] = sensors.mena\(\)\): Unknown attribute 'mena'"),
        (opens_a_file, 1, "must be Python that Numba compiles .*construct is not supported"),
    ],
)
def test_a_slip_in_a_controller_is_one_line_in_a_batch_and_on_a_port(controller, number, words):
    source = controller.function.__code__
    for drive in (
        lambda: values_of(controller, [float(number)]),
        lambda: kiks.drive(kiks.Simulation(ROOM).port(1), controller, [float(number)], seconds=0.5),
    ):
        with pytest.raises(ParameterError, match=words) as caught:
            drive()
        (line,) = str(caught.value).splitlines()
        assert f"controller {controller.name!r}" in line
        if named := re.search(r"line (\d+) of test_checked_code.py", line):
            assert "numbers[of" in line or int(named[1]) - source.co_firstlineno in range(23)
        assert "arrayobj" not in line


@kiks.measure
def forgets_notes(moment, notes):
    notes[0] += moment.wheels[0]
    notes[1] += 1.0


@kiks.measure
def asks_for_a_ball(moment, notes):
    notes[0] = moment.bodies[0].x_mm


@kiks.measure
def asks_for_happiness(moment, notes):
    notes[0] = moment.happiness


@kiks.measure
def returns_its_value(moment, notes):
    return moment.path_mm


def nothing(moment, notes):
    """Note nothing."""


@pytest.mark.parametrize(
    ("measure", "words"),
    [
        (forgets_notes, r"notes\[1\] \+= 1.0\) leaves notes, which has 1 number. Write @kiks.measure\(notes=2\)"),
        (asks_for_a_ball, r"leaves moment.bodies"),
        (asks_for_happiness, "the measure 'asks_for_happiness' must be Python that Numba compiles"),
        (returns_its_value, "it returns something"),
        (kiks.measure(result=lambda notes: notes[0])(nothing), r"\(4, 1\), .* of shape \(1, 1\)"),
        (kiks.measure(result=lambda notes: notes.max())(nothing), r"of shape \(\)"),
        (kiks.measure(result=lambda notes: notes[..., 1])(nothing), "IndexError"),
        (kiks.measure(result=lambda notes: "far")(nothing), "no numbers"),
    ],
)
def test_a_slip_in_a_measure_is_one_line(measure, words):
    with pytest.raises(ParameterError, match=words) as caught:
        values_of(kiks.controllers.linear(), SLOW_AHEAD, [kiks.measures.path_mm, measure])
    assert "\n" not in str(caught.value)


@kiks.controller(parameters=5, memory=3)
def goes_anywhere(sensors, memory, parameters, wheels):
    which, index = int(parameters[0]), int(parameters[1])
    if which == 0:
        wheels[0] = sensors[index]
    elif which == 1:
        memory[index] = 1.0
    elif which == 2:
        wheels[1] = parameters[index]
    else:
        wheels[index] = 3.0


@given(st.integers(0, 3), st.integers(-12, 12) | st.integers(-(2**40), 2**40))
def test_compiled_code_raises_where_python_does(which, index):
    parameters = np.array([which, index, 3, 4, 5.0])
    results = []
    for decide in (goes_anywhere.function, goes_anywhere):
        arrays = np.arange(8.0), np.zeros(3), parameters, np.zeros(2)
        try:
            decide(*arrays)
        except (IndexError, KiksError):
            results.append(None)
        else:
            results.append([each.tolist() for each in arrays])
    assert results[0] == results[1]
    assert (results[0] is not None) == (-(size := (8, 3, 5, 2)[which]) <= index < size)


def test_a_batch_goes_on_after_a_slip():
    batch, ahead = kiks.Batch(ROOM, worlds=3, seed=1), kiks.controllers.linear()
    before = batch.run(ahead, SLOW_AHEAD, seconds=0.5, measures=[kiks.measures.path_mm]).values
    refused("leaves memory", batch.run, slips, [0.0], seconds=0.5)
    after = batch.run(ahead, SLOW_AHEAD, seconds=0.5, measures=[kiks.measures.path_mm]).values
    assert after.tolist() == before.tolist()
    stepped = kiks.Batch(ROOM, worlds=3, seed=1, measures=[forgets_notes])
    stepped.reset()
    refused("leaves notes", stepped.step, np.ones((3, 1, 2)))
    refused(re.escape("reset() must be called"), stepped.step, np.ones((3, 1, 2)))
