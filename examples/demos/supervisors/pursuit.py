"""End the pursuit when predator and prey touch."""

import math

TOUCH_MM = 2.0  # robots with such a gap touch


def supervise(sim):
    predator, prey = sim.specs[:2]
    near_mm = predator.body.radius_mm + prey.body.radius_mm + TOUCH_MM
    while True:
        yield 0.05
        (x_mm, y_mm, _), (prey_x_mm, prey_y_mm, _) = sim.poses()[:2]
        if math.dist((x_mm, y_mm), (prey_x_mm, prey_y_mm)) <= near_mm:
            print(f"predator and prey touched after {sim.time_s:.1f} s")
            return
