"""What notebooks show of evolutions and of what they find."""

from __future__ import annotations

from kiks.export.notebook import Bundle, figure, html, html_table
from kiks.learn.archive import Archive
from kiks.learn.champion import Champion
from kiks.learn.evolution import Evolution
from kiks.learn.plots import figure_of_archive, figure_of_evolution


def evolution(given: Evolution) -> Bundle:
    """Return how fitness grew, and the archive if there is one; nothing before the first generation."""
    if not given.generations:
        return {}, {}
    shown = figure_of_evolution(given)
    return figure(shown, shown.get_figwidth())


def archive(given: Archive) -> Bundle:
    """Return a map of an archive; nothing before its first elite."""
    return figure(shown := figure_of_archive(given), shown.get_figwidth()) if given.elites else ({}, {})


def champion(given: Champion) -> Bundle:
    """Return what a champion is, and its measures."""
    facts = {"task": given.task, "controller": repr(given.controller), "fitness": f"{given.fitness:.4g}"}
    facts |= {name: f"{value:.4g}" for name, value in given.measures.items()}
    return html(html_table([[name, text] for name, text in facts.items() if text]))
