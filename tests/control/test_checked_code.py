"""Functions of users stay within their arrays, or one line says which line leaves which array."""

from __future__ import annotations

import re
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kiks
from kiks.errors import KiksError, ParameterError

ROOM = kiks.Arena.box(600, 600)
SLOW_AHEAD = [4.0, 4.0] + [0.0] * 16


def values_of(controller: Any, parameters: Any, measures: Any = (kiks.measures.path_mm,), **options: Any) -> Any:
    return (
        kiks.Batch(ROOM, **{"worlds": 4, "seed": 1} | options)
        .run(controller, parameters, seconds=0.5, measures=measures)
        .values
    )


@numba.njit
def third(numbers, of):
    return numbers[of + 2]


elsewhere = ModuleType("elsewhere")
elsewhere.third = third  # type: ignore[attr-defined]


@kiks.controller(parameters=1)
def forgets_memory(sensors, memory, parameters, wheels):
    memory[0] += 1.0
    wheels[0] = memory[0]


@kiks.controller(parameters=1)
def ninth_sensor(sensors, memory, parameters, wheels):
    for k in range(9):
        wheels[0] += sensors[k]


@kiks.controller(parameters=1)
def third_wheel(sensors, memory, parameters, wheels):
    w = wheels
    w[-3] = 1.0


@kiks.controller(parameters=1)
def second_parameter(s, m, p, w):
    w[0] = p[1]


@kiks.controller(parameters=1)
def far_away(sensors, memory, parameters, wheels):
    wheels[50_000_000] = 1.0


@kiks.controller(parameters=1)
def asks_a_helper(sensors, memory, parameters, wheels):
    wheels[0] = third(parameters, 0)


@kiks.controller(parameters=1)
def asks_a_helper_elsewhere(sensors, memory, parameters, wheels):
    wheels[0] = elsewhere.third(parameters, 0)


@kiks.controller(parameters=1)
def raises(sensors, memory, parameters, wheels):
    if parameters[0] > 0:
        raise ValueError("nothing to do")


@kiks.controller(parameters=1)
def assigns_eight(sensors, memory, parameters, wheels):
    wheels[:] = sensors


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


SLIPS = [
    (forgets_memory, r"memory\[0\] \+= 1.0\) leaves memory, which has 0 numbers. Write @kiks.controller\(memory=1\)"),
    (ninth_sensor, r"\+= sensors\[k\]\) leaves sensors, which has 8 numbers"),
    (third_wheel, r"w\[-3\] = 1.0\) leaves wheels, which has 2 numbers"),
    (second_parameter, r"w\[0\] = p\[1\]\) leaves p, which has 1 number. Write @kiks.controller\(parameters=2\)"),
    (far_away, "leaves wheels"),
    (asks_a_helper, r"return numbers\[of \+ 2\]\) leaves numbers"),
    (asks_a_helper_elsewhere, r"return numbers\[of \+ 2\]\) leaves numbers"),
    (raises, r'raise ValueError\("nothing to do"\)\): ValueError: nothing to do'),
    (assigns_eight, "ValueError: cannot assign slice"),
    (returns, "it returns something, where it must write into its arguments"),
    (misspells, r"wheels\[1\] = sensors.mena\(\)\): Unknown attribute 'mena'"),
    (opens_a_file, "must be Python that Numba compiles .*construct is not supported"),
]


@pytest.mark.parametrize(("controller", "words"), SLIPS, ids=[each.name for each, _ in SLIPS])
def test_a_slip_in_a_controller_is_one_line_in_a_batch_and_on_a_port(controller, words):
    source = controller.function.__code__
    for drive in (
        lambda: values_of(controller, [1.0]),
        lambda: kiks.drive(kiks.Simulation(ROOM).port(1), controller, [1.0], seconds=0.5),
    ):
        with pytest.raises(ParameterError, match=words) as caught:
            drive()
        (line,) = str(caught.value).splitlines()
        assert f"controller {controller.name!r}" in line
        if named := re.search(r"line (\d+) of test_checked_code.py", line):
            assert "helper" in controller.name or int(named[1]) - source.co_firstlineno in range(10)
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


@pytest.mark.parametrize(
    ("measure", "words"),
    [
        (forgets_notes, r"notes\[1\] \+= 1.0\) leaves notes, which has 1 number. Write @kiks.measure\(notes=2\)"),
        (asks_for_a_ball, r"leaves moment.bodies"),
        (asks_for_happiness, "the measure 'asks_for_happiness' must be Python that Numba compiles"),
        (returns_its_value, "it returns something"),
        (kiks.measure(result=lambda notes: notes[0])(lambda moment, notes: None), r"\(4, 1\), .* of shape \(1, 1\)"),
        (kiks.measure(result=lambda notes: notes.max())(lambda moment, notes: None), r"of shape \(\)"),
        (kiks.measure(result=lambda notes: notes[..., 1])(lambda moment, notes: None), "IndexError"),
        (kiks.measure(result=lambda notes: "far")(lambda moment, notes: None), "no numbers"),
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
    with pytest.raises(ParameterError, match="leaves memory"):
        batch.run(forgets_memory, [1.0], seconds=0.5)
    after = batch.run(ahead, SLOW_AHEAD, seconds=0.5, measures=[kiks.measures.path_mm]).values
    assert after.tolist() == before.tolist()
    stepped = kiks.Batch(ROOM, worlds=3, seed=1, measures=[forgets_notes])
    stepped.reset()
    with pytest.raises(ParameterError, match="leaves notes"):
        stepped.step(np.ones((3, 1, 2)))
    with pytest.raises(ParameterError, match=re.escape("reset() must be called")):
        stepped.step(np.ones((3, 1, 2)))
