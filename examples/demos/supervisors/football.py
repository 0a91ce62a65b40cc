"""End the match at the first goal."""

from kiks.model import pitch


def supervise(sim):
    while True:
        yield 0.05
        ball = sim.bodies()[0]
        if goal := pitch.goal_at(ball["x_mm"], ball["radius_mm"]):
            print(f"{'left' if goal == 1 else 'right'} scored after {sim.time_s:.1f} s")
            return
