"""A drawing of a sensor's seven rays: their lengths, what they hit, and their contributions to the reading."""

from __future__ import annotations

import math
from html import escape

from kiks.export.looks import BALL_COLOUR, CYLINDER_COLOUR, css, robot_colour
from kiks.sim.explanation import Explanation, SeenRay

WIDTH, HEIGHT = 360, 236
_EYE = (180.0, 206.0)
_REACH = 150.0
_COLOURS = {"wall": "#8a6d3b", "ball": css(BALL_COLOUR), "cylinder": css(CYLINDER_COLOUR)}
_RANGES_MM = (6.0, 15.0, 30.0, 60.0)
_THIN, _THICK = 1.5, 6.0


def draw_rays(why: Explanation) -> str:
    """Return an SVG of the rays, with the sensor's axis upwards, in the text colour of the page."""
    axis_deg = why.rays[len(why.rays) // 2].angle_deg
    most = max((abs(ray.contribution_counts) for ray in why.rays), default=0.0)
    reach_mm = _range_mm(why)
    parts = [_ring(share, reach_mm) for share in (1 / 3, 2 / 3, 1.0)]
    for number, ray in enumerate(why.rays, 1):
        share = abs(ray.contribution_counts) / most if most >= 0.5 else 0.0
        parts.append(_ray(number, ray, _turn_deg(ray.angle_deg - axis_deg), reach_mm, share))
    x, y = _EYE
    parts.append(f'<rect x="{x - 12}" y="{y}" width="24" height="12" rx="2" fill="currentColor"/>')
    parts.append(_words(x, y + 26, f"sensor {why.sensor}", size=12))
    label = escape(f"Rays of sensor {why.sensor}: " + "; ".join(_describe(ray) for ray in why.rays), quote=True)
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}" '
        f'style="width: 100%; max-width: 460px; display: block; margin: 0 auto">{"".join(parts)}</svg>'
    )


def _range_mm(why: Explanation) -> float:
    """Return the range of the drawing: the sensor's reach, or less if all rays end nearer."""
    longest_mm = max(ray.length_mm for ray in why.rays)
    if math.isinf(longest_mm):
        return why.reach_mm
    return min((range_mm for range_mm in _RANGES_MM if range_mm >= longest_mm), default=why.reach_mm)


def _turn_deg(angle_deg: float) -> float:
    return (angle_deg + 180.0) % 360.0 - 180.0


def _describe(ray: SeenRay) -> str:
    return "nothing" if math.isinf(ray.length_mm) else f"{ray.met} at {ray.length_mm:.1f} mm"


def _point(turn_deg: float, way: float) -> tuple[float, float]:
    """Return the point of the drawing at the distance `way` along a ray; a positive turn is to the left."""
    turn = math.radians(turn_deg)
    return _EYE[0] - way * math.sin(turn), _EYE[1] - way * math.cos(turn)


def _ring(share: float, reach_mm: float) -> str:
    (x0, y0), (x1, y1), way = _point(66.0, share * _REACH), _point(-66.0, share * _REACH), share * _REACH
    arc = (
        f'<path d="M{x0:.1f} {y0:.1f} A{way:.1f} {way:.1f} 0 0 1 {x1:.1f} {y1:.1f}" fill="none" stroke="currentColor" '
    )
    return arc + 'opacity=".25"/>' + _words(x1 + 4, y1 + 14, f"{share * reach_mm:.0f} mm", size=10, faint=True)


def _ray(number: int, ray: SeenRay, turn_deg: float, reach_mm: float, share: float) -> str:
    is_nothing = math.isinf(ray.length_mm)
    x, y = _point(turn_deg, _REACH * (1.0 if is_nothing else min(ray.length_mm / reach_mm, 1.0)))
    x0, y0 = _EYE
    line = f'<line x1="{x0}" y1="{y0}" x2="{x:.1f}" y2="{y:.1f}" stroke='
    if is_nothing:
        drawn = line + '"currentColor" stroke-width="1" stroke-dasharray="3 4" opacity=".5"/>'
    else:
        what, _, met = ray.met.partition(" ")
        colour = css(robot_colour(int(met) - 1)) if what == "robot" else _COLOURS[what]
        drawn = line + f'"{colour}" stroke-width="{_THIN + share * (_THICK - _THIN):.1f}" stroke-linecap="round"/>'
        drawn += _surface(ray, turn_deg, x, y, colour)
    at_x, at_y = _point(turn_deg, _REACH + 18.0)
    length = "–" if is_nothing else f"{ray.length_mm:.1f}"
    return drawn + _words(at_x, at_y - 6, str(number), size=11, faint=True) + _words(at_x, at_y + 8, length, size=13)


def _surface(ray: SeenRay, turn_deg: float, x: float, y: float, colour: str) -> str:
    """Return the symbol of what a ray hit: a bar for a wall, a ring for a robot, a disc for a ball or cylinder."""
    if ray.met == "wall":
        fill = f"rgb({ray.brightness},{ray.brightness},{ray.brightness})"
        turn = f'transform="rotate({-turn_deg:.1f} {x:.1f} {y:.1f})"'
        return (
            f'<rect x="{x - 9:.1f}" y="{y - 6:.1f}" width="18" height="6" {turn} fill="{fill}" stroke="{colour}" '
            'stroke-width="1.5"/>'
        )
    fill = "none" if ray.met.startswith("robot") else colour
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="{fill}" stroke="{colour}" stroke-width="2.5"/>'


def _words(x: float, y: float, text: str, *, size: int, faint: bool = False) -> str:
    opacity = ' opacity=".7"' if faint else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle" fill="currentColor" font-size="{size}"{opacity}>'
        f"{escape(text)}</text>"
    )
