"""Algorithms that look for many behaviours, by the library pyribs."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from kiks.errors import ParameterError, library
from kiks.learn.algorithm import Floats, Positive, Setting
from kiks.model.data_file import Whole, record


class Diverse:
    """Finds many behaviours: new candidates come from an archive of those that differ, by pyribs.

    Behaviours are counted in cells of the axes, so that axes with different units count alike.
    """

    @record
    class Options:
        """Options of algorithms that look for many behaviours.

        Args:
            cells: Number of the cells of their archive, spread over the whole space of behaviours, for many axes; 0:
                those of the axes, a grid.
        """

        cells: Annotated[Whole, Field(ge=0, le=1_000_000)] = 0

    def __init__(self, setting: Setting, options: Options) -> None:
        axes = setting.axes
        self._options: Any = options
        if not axes:
            raise ParameterError(
                "the task must have axes along which behaviours differ for this algorithm, but it has none. "
                "Give it some, or take cma."
            )
        self._axis_count = len(axes)
        self._low, self._high = (np.array([getattr(axis, name) for axis in axes]) for name in ("low", "high"))
        # pyribs gets behaviours in cells, so that axes of different units count alike.
        self._cell = (self._high - self._low) / [axis.cells for axis in axes]
        schedulers, archives = library("ribs.schedulers"), library("ribs.archives")
        archive = self.make_archive(archives, setting)
        self._scheduler: Any = schedulers.Scheduler(
            archive, self.make_emitters(library("ribs.emitters"), archive, setting)
        )

    def make_archive(self, archives: Any, setting: Setting) -> Any:
        """Return the archive: one elite for each cell.

        Cells without a grid lie around points of a scrambled Halton sequence (Mouret, Fast generation of centroids for
        MAP-Elites, 2023); they are those of Vassiliades and others (Using centroidal Voronoi tessellations to scale up
        the multidimensional archive of phenotypic elites algorithm, 2018) but for the points.
        """
        cells = [axis.cells for axis in setting.axes]
        ranges = [(0, count) for count in cells]
        if count := self._options.cells:
            # A grid over many axes would have more cells than there are candidates.
            points = library("scipy.stats.qmc").Halton(len(cells), seed=setting.seed).random(count)
            given = {"solution_dim": setting.parameter_count, "ranges": ranges, "seed": setting.seed}
            return archives.CVTArchive(centroids=points * cells, **given)
        return archives.GridArchive(solution_dim=setting.parameter_count, dims=cells, ranges=ranges, seed=setting.seed)

    def make_emitters(self, emitters: Any, archive: Any, setting: Setting) -> list[Any]:
        """Return what proposes candidates."""
        raise NotImplementedError

    def ask(self) -> Floats:
        """Return the next generation."""
        return np.array(self._scheduler.ask())

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Put candidates into the archive that are new, or better than what is there."""
        if behaviours.shape[1] < self._axis_count:
            raise ParameterError(
                "tell() must be given fitness and measures for this algorithm, but it was given fitness alone."
            )
        # What lies beyond an end of an axis is nothing new.
        inside = np.clip(behaviours[:, : self._axis_count], self._low, self._high)
        self._scheduler.tell(fitness, (inside - self._low) / self._cell)

    def favourite(self) -> None:
        """Return None: it prefers none of its behaviours."""


class MapElites(Diverse):
    """MAP-Elites: keeps the best candidate for each cell of a map of behaviours; all of them are parents.

    A new candidate lies near an elite, moved along the line to another one (Vassiliades and Mouret 2018).
    """

    @record
    class Options(Diverse.Options):
        """Options of MAP-Elites.

        Args:
            cells: Number of the cells of its archive, spread over the whole space of behaviours, for many axes; 0:
                those of the axes, a grid.
            near: Standard deviation of a child's distance from its parent in all directions, relative to that of the
                first generation.
            along: Standard deviation of a child's distance along the line, relative to that to the other elite.
        """

        near: Positive = 0.2
        along: Positive = 0.2

    def make_emitters(self, emitters: Any, archive: Any, setting: Setting) -> list[Any]:
        """Return an emitter of variations of elites."""
        count, seed, rng = setting.population, setting.seed, np.random.default_rng(setting.seed)
        first = setting.spread * rng.standard_normal((count, setting.parameter_count))
        sigmas = {"iso_sigma": self._options.near * setting.spread, "line_sigma": self._options.along}
        return [emitters.IsoLineEmitter(archive, **sigmas, initial_solutions=first, batch_size=count, seed=seed)]


class CmaMe(Diverse):
    """CMA-ME: several CMA-ES that follow what improves the map most; each restarts at an elite when it finds nothing.

    Source: Fontaine and others, Covariance matrix adaptation for the rapid illumination of behavior space, 2020.
    """

    @record
    class Options(Diverse.Options):
        """Options of CMA-ME.

        Args:
            cells: Number of the cells of its archive, spread over the whole space of behaviours, for many axes; 0:
                those of the axes, a grid.
            strategy: Number of candidates of a strategy; a larger population has several.
        """

        strategy: Annotated[Whole, Field(ge=2, le=1_000_000)] = 40

    RANKER, SELECTION, RESTART = "2imp", "filter", "no_improvement"
    """What pyribs ranks candidates by, which of them it follows, and when a strategy restarts."""

    def make_emitters(self, emitters: Any, archive: Any, setting: Setting) -> list[Any]:
        """Return the strategies."""
        parts = np.array_split(np.arange(setting.population), max(1, setting.population // self._options.strategy))
        return [
            emitters.EvolutionStrategyEmitter(
                archive,
                x0=np.zeros(setting.parameter_count),
                sigma0=setting.spread,
                ranker=self.RANKER,
                selection_rule=self.SELECTION,
                restart_rule=self.RESTART,
                batch_size=len(part),
                seed=child,
            )
            for part, child in zip(parts, np.random.SeedSequence(setting.seed).spawn(len(parts)), strict=True)
        ]


class Novelty(CmaMe):
    """Novelty search: the same strategies follow what was not seen before, and fitness does not count.

    Novelty is the mean distance from the nearest behaviours of an archive, which those that are novel enough enter
    (Lehman and Stanley, Abandoning objectives, 2011).
    """

    @record
    class Options:
        """Options of novelty search.

        Args:
            strategy: Number of candidates of a strategy; a larger population has several.
            neighbours: Number of nearest behaviours that count.
            novelty: The least novelty for the archive [cells].
        """

        strategy: Annotated[Whole, Field(ge=2, le=1_000_000)] = 40
        neighbours: Annotated[Whole, Field(ge=1, le=10_000)] = 15
        novelty: Positive = 1.0

    RANKER, SELECTION, RESTART = "nov", "mu", "basic"

    def make_archive(self, archives: Any, setting: Setting) -> Any:
        """Return the archive of novel behaviours."""
        return archives.ProximityArchive(
            solution_dim=setting.parameter_count,
            measure_dim=len(setting.axes),
            k_neighbors=self._options.neighbours,
            novelty_threshold=self._options.novelty,
            seed=setting.seed,
        )
