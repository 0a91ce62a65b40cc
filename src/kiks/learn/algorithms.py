"""The algorithms: they propose candidates and learn from their fitness.

An algorithm draws all random numbers from its seed, and depends on nothing but the values that it is told: the same
seed and values give the same candidates. So an evolution resumes by telling all generations again.
"""

from __future__ import annotations

from collections.abc import Sequence
from configparser import ConfigParser
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.control.controller import Controller
from kiks.errors import ParameterError, library
from kiks.learn.algorithm_name import AlgorithmName, parts_of, text_of
from kiks.learn.chance import Chance
from kiks.learn.task import Axis
from kiks.model.data_file import Number, OneOf, Switch, Whole, record, table_of

Floats = NDArray[np.float64]


class Algorithm(Protocol):
    """Proposes candidates. `ask` and `tell` alternate; an algorithm of a user's own may do without `favourite`."""

    def ask(self) -> Floats:
        """Return the next generation, float64 [candidate, parameter]."""
        ...

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Take their fitness, float64 [candidate], and their behaviours, float64 [candidate, axis and objective].

        More is better of an objective, so those with a minus before their names are the measures negated.
        """

    def favourite(self) -> Floats | None:
        """Return the best parameters according to the algorithm, float64 [parameter].

        None if it looks for many behaviours and prefers none: then the best one of the evolution's archive counts.
        """
        ...


class Setting(NamedTuple):
    """What an algorithm begins with.

    Attributes:
        parameter_count: Number of parameters of a candidate.
        population: Number of candidates in a generation.
        seed: Seed of its random numbers.
        axes: Axes along which behaviours differ.
        spread: Standard deviation of each parameter at the beginning.
        objectives: Names of the objectives.
        controller: The controller whose parameters evolve.
    """

    parameter_count: int
    population: int
    seed: int
    axes: Sequence[Axis]
    spread: float
    objectives: Sequence[str]
    controller: Controller


Share = Annotated[Number, Field(ge=0, le=1)]
Positive = Annotated[Number, Field(gt=0, le=1e6)]


class Cma:
    """CMA-ES: a normal distribution whose mean and covariance adapt to the successful candidates.

    A strategy that has begun again has whole generations of candidates, up to hundreds: it learns when it knows all.
    IPOP: Auger and Hansen, A restart CMA evolution strategy with increasing population size, 2005. BIPOP: Hansen,
    Benchmarking a BI-population CMA-ES on the BBOB-2009 function testbed, 2009.
    """

    @record
    class Options:
        """Options of CMA-ES.

        Args:
            separable: Whether the covariance stays diagonal: for hundreds of parameters (Ros and Hansen 2008).
            active: Whether bad candidates count, too, against their directions.
            restarts: Where a strategy begins again that finds nothing any more: 'ipop' each time with twice as many
                candidates, 'bipop' with many or few of them in turn, 'none' nowhere.
            starts: How many strategies begin, which take turns; the best one goes on alone.
            race: Number of generations that each of them has before.
        """

        separable: Switch = False
        active: Switch = True
        restarts: Annotated[str, OneOf(("none", "ipop", "bipop"))] = "none"
        starts: Annotated[Whole, Field(ge=1, le=100)] = 1
        race: Annotated[Whole, Field(ge=1, le=10_000)] = 15

    JUDGED = 5
    """Number of last generations by which the strategies of a race are judged: each has worlds of its own."""

    def __init__(self, setting: Setting, options: Options) -> None:
        self._setting, self._options, self._rng = setting, options, np.random.default_rng(setting.seed)
        self._doublings, self._used = 0, {False: 0, True: 0}  # evaluations of large strategies, and of small ones
        self._mean = np.zeros(setting.parameter_count)
        self._strategy: Any
        self._racing: list[tuple[Any, list[float]]] = []  # those that wait for their turn, and how well they did
        for _ in range(options.starts):
            self._begin(np.zeros(setting.parameter_count), setting.spread, 1)
            self._racing.append((self._strategy, []))
        self._strategy, self._fitness = self._racing.pop(0)

    def _begin(self, mean: Floats, spread: float, generations: int, *, is_small: bool = False) -> None:
        """Begin a strategy whose candidates fill so many generations."""
        options = {
            "popsize": self._setting.population * generations,
            "randn": lambda *shape: self._rng.standard_normal(shape),
            "seed": np.nan,  # leaves the random numbers of the process alone
            "verbose": -9,
            "verb_log": 0,
            "CMA_diagonal": self._options.separable,
            "CMA_active": self._options.active,
        }
        self._strategy = library("cma").CMAEvolutionStrategy(mean, spread, options)
        self._candidates: list[Floats] = []
        self._costs: list[float] = []
        self._is_small = is_small

    def ask(self) -> Floats:
        """Return the next generation."""
        if not self._candidates:
            self._candidates = self._strategy.ask()
        told = len(self._costs)
        return np.array(self._candidates[told : told + self._setting.population])

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Take their fitness."""
        self._costs += (-fitness).tolist()
        self._used[self._is_small] += len(fitness)
        if len(self._costs) == len(self._candidates):
            self._strategy.tell(self._candidates, self._costs)
            self._candidates, self._costs, self._mean = [], [], np.array(self._strategy.mean)
            if self._racing:
                self._take_turns(fitness)
            elif self._options.restarts != "none" and self._strategy.stop():
                self._begin_again()

    def _take_turns(self, fitness: Floats) -> None:
        """Let the next strategy go on, or the best one alone if each has had its generations."""
        self._fitness.append(float(np.sort(fitness)[len(fitness) // 2 :].mean()))
        self._racing.append((self._strategy, self._fitness))
        if all(len(told) == self._options.race for _, told in self._racing):
            best = max(self._racing, key=lambda each: np.mean(each[1][-self.JUDGED :]))
            (self._strategy, _), self._racing = best, []
        else:
            self._strategy, self._fitness = self._racing.pop(0)

    def _begin_again(self) -> None:
        rng, spread = self._rng, self._setting.spread
        is_small = self._options.restarts == "bipop" and self._doublings > 0 and self._used[True] < self._used[False]
        self._doublings += not is_small
        generations = 2.0**self._doublings
        if is_small:
            generations = (0.5 * generations) ** (rng.random() ** 2)
            spread *= 10.0 ** (-2.0 * rng.random())
        mean = self._setting.spread * rng.standard_normal(self._setting.parameter_count)
        self._begin(mean, spread, round(generations), is_small=is_small)

    def favourite(self) -> Floats:
        """Return the mean of the distribution that has learned last."""
        mean: Floats = self._mean.copy()
        return mean


class Ga:
    """A genetic algorithm: tournaments, each parameter from either parent, normal mutations, one elite."""

    @record
    class Options:
        """Options of the genetic algorithm.

        Args:
            mutation: Standard deviation of a mutation, relative to that of the first generation.
            rivals: Number of candidates in a tournament.
        """

        mutation: Positive = 0.07
        rivals: Annotated[Whole, Field(ge=1, le=1000)] = 3

    def __init__(self, setting: Setting, options: Options) -> None:
        self._rng, self._options = np.random.default_rng(setting.seed), options
        self._spread = setting.spread
        self._candidates = self._spread * self._rng.standard_normal((setting.population, setting.parameter_count))
        self._favourite = self._candidates[0]

    def ask(self) -> Floats:
        """Return the next generation."""
        return self._candidates.copy()

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        rng, (population, parameter_count) = self._rng, self._candidates.shape
        self._favourite = self._candidates[np.argmax(fitness)].copy()
        rivals = rng.integers(population, size=(2, population, self._options.rivals))
        winners = np.take_along_axis(rivals, fitness[rivals].argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
        mothers, fathers = self._candidates[winners]
        children = np.where(rng.random((population, parameter_count)) < 0.5, mothers, fathers)
        children += self._options.mutation * self._spread * rng.standard_normal(children.shape)
        children[0] = self._favourite
        self._candidates = children

    def favourite(self) -> Floats:
        """Return the best of the last generation."""
        best: Floats = self._favourite.copy()
        return best


class Sga:
    """A simple genetic algorithm: selection, one-point crossover, mutation; the children replace all parents.

    Bits of a parameter are a binary number, the highest first. Real numbers begin, and mutate, evenly spread with the
    deviation of the first generation; they have no bounds. Fitness is scaled linearly before a roulette wheel turns, so
    that the best candidate has `BEST` times the chance of an average one, or less if the worst would have none
    (Goldberg, Genetic Algorithms in Search, Optimization, and Machine Learning, 1989).
    """

    @record
    class Options:
        """Options of the simple genetic algorithm.

        Args:
            bits: Number of bits of a parameter; 0 for real numbers.
            limit: Parameters of bits lie within +-limit.
            selection: 'best': the best have equally many children; 'roulette': each has what its fitness is worth.
            parents: Share of the population that counts among the best.
            crossover: Probability that two children exchange all genes from a random place on.
            mutation: Probability that a gene mutates.
        """

        bits: Annotated[Whole, Field(ge=0, le=32)] = 5
        limit: Positive = 10.0
        selection: Annotated[str, OneOf(("best", "roulette"))] = "best"
        parents: Annotated[Number, Field(gt=0, le=1)] = 0.2
        crossover: Share = 0.6
        mutation: Share = 0.05

    BEST = 2.0
    """Chance of the best candidate on the wheel, as a multiple of the mean one."""

    def __init__(self, setting: Setting, options: Options) -> None:
        self._options, self._rng = options, np.random.default_rng(setting.seed)
        self._reach = setting.spread * np.sqrt(3.0)
        count, size, reach = setting.population, setting.parameter_count, self._reach
        self._genes: NDArray[Any] = (
            self._rng.integers(2, size=(count, size * options.bits))
            if options.bits
            else self._rng.uniform(-reach, reach, (count, size))
        )
        self._favourite = self.ask()[0]

    def ask(self) -> Floats:
        """Return the next generation."""
        bits, limit = self._options.bits, self._options.limit
        if not bits:
            return self._genes.copy()
        numbers = self._genes.reshape(len(self._genes), -1, bits) @ 2 ** np.arange(bits)[::-1]
        candidates: Floats = numbers * (2.0 * limit / (2**bits - 1)) - limit
        return candidates

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        rng, options, (count, size) = self._rng, self._options, self._genes.shape
        self._favourite = self.ask()[fitness.argmax()]
        if options.selection == "best":
            best = np.argsort(-fitness, kind="stable")[: max(1, round(options.parents * count))]
            children: NDArray[Any] = self._genes[rng.permutation(np.resize(best, count))]
        else:
            children = self._genes[rng.choice(count, count, p=self._chances(fitness))]
        for first in range(0, count - 1, 2):
            if rng.random() < options.crossover:
                tail = np.arange(size) >= rng.integers(1, max(size, 2))
                pair = children[first : first + 2]
                children[first : first + 2] = np.where(tail, pair[::-1], pair)
        mutates = rng.random(children.shape) < options.mutation
        if options.bits:
            self._genes = children ^ mutates
        else:
            self._genes = children + mutates * rng.uniform(-self._reach, self._reach, children.shape)

    def _chances(self, fitness: Floats) -> Floats:
        """Return the chance of each candidate on the wheel, float64 [candidate]."""
        mean, best, worst = fitness.mean(), fitness.max(), fitness.min()
        if best <= mean or worst >= mean:
            return np.full(len(fitness), 1.0 / len(fitness))
        gain = min((self.BEST - 1.0) / (best - mean), 1.0 / (mean - worst))
        scaled = np.maximum(1.0 + gain * (fitness - mean), 0.0)
        chances: Floats = scaled / scaled.sum()
        return chances

    def favourite(self) -> Floats:
        """Return the best of the last generation."""
        best: Floats = self._favourite.copy()
        return best


class Nsga2:
    """NSGA-II: several objectives; those that no other one surpasses in all of them live on, and the lonely ones first.

    Each generation has other worlds. So its first half are the survivors of the last one, evaluated again, and no one
    lives on by good luck; the other half are their children. DEAP ranks them (Deb and others, A fast and elitist
    multiobjective genetic algorithm: NSGA-II, 2002); children are made as those of `Ga`.
    """

    @record
    class Options:
        """Options of NSGA-II.

        Args:
            mutation: Standard deviation of a mutation, relative to that of the first generation.
        """

        mutation: Positive = 0.07

    def __init__(self, setting: Setting, options: Options) -> None:
        if len(setting.objectives) < 2:
            raise ParameterError(
                f"the task must have at least two objectives for nsga2, but it has {len(setting.objectives)}. "
                "Give it some, such as objectives=['path_mm', '-contacts'], or take another algorithm."
            )
        self._setting, self._options, self._rng = setting, options, np.random.default_rng(setting.seed)
        self._candidates = setting.spread * self._rng.standard_normal((setting.population, setting.parameter_count))
        self._favourite = self._candidates[0]
        weights = {"weights": (1.0,) * len(setting.objectives)}
        self._fitness: Any = type("Fitness", (library("deap.base").Fitness,), weights)

    def ask(self) -> Floats:
        """Return the next generation."""
        return self._candidates.copy()

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Let the best half live on, and breed from it."""
        rng, population = self._rng, len(self._candidates)
        objectives = behaviours[:, len(self._setting.axes) :]
        if objectives.shape[1] != len(self._setting.objectives):
            raise ParameterError("tell() must be given fitness and measures for nsga2, but it was given fitness alone.")
        self._favourite = self._candidates[fitness.argmax()].copy()
        ranked = [
            SimpleNamespace(number=number, fitness=self._fitness(values))
            for number, values in enumerate(objectives.tolist())
        ]
        survivors = library("deap.tools").selNSGA2(ranked, population // 2)
        fronts = library("deap.tools").sortNondominated(survivors, len(survivors))
        best_first = [
            each.number for front in fronts for each in sorted(front, key=lambda each: -each.fitness.crowding_dist)
        ]
        parents = self._candidates[best_first]
        rivals = rng.integers(len(parents), size=(2, population - len(parents), 2)).min(axis=2)
        mothers, fathers = parents[rivals]
        children = np.where(rng.random(mothers.shape) < 0.5, mothers, fathers)
        children += self._options.mutation * self._setting.spread * rng.standard_normal(children.shape)
        self._candidates = np.concatenate([parents, children])

    def favourite(self) -> Floats:
        """Return the fittest of the last generation."""
        best: Floats = self._favourite.copy()
        return best


class Neat:
    """NEAT: networks that begin without hidden neurons and grow, in species that protect what is new.

    Source: Stanley and Miikkulainen, Evolving neural networks through augmenting topologies, 2002; the library is
    neat-python. The controller must be `kiks.controllers.graph`: its parameters hold any network of so many hidden
    neurons, with zeros for connections that are not there.
    """

    @record
    class Options:
        """Options of NEAT; of each probability that for a child.

        Args:
            add_neuron: Probability of a new neuron, in the middle of a connection.
            add_connection: Probability of a new connection.
            remove: Probability to lose a connection, and a neuron.
            mutation: Standard deviation of a mutation of a weight, relative to that of the first generation.
            threshold: Genetic distance from which on two candidates belong to different species.
            stagnation: Generations after which a species dies that does not improve.
        """

        add_neuron: Share = 0.1
        add_connection: Share = 0.2
        remove: Share = 0.05
        mutation: Positive = 0.1
        threshold: Positive = 2.0
        stagnation: Annotated[Whole, Field(ge=1, le=100_000)] = 20

    def __init__(self, setting: Setting, options: Options) -> None:
        recipe = setting.controller.recipe or {}
        if recipe.get("kind") != "graph":
            raise ParameterError(
                f"the controller must be a graph for neat, but it was {setting.controller.name}. "
                "Give kiks.controllers.graph(), or --controller graph."
            )
        self._neuron_count = 2 + recipe["hidden"]
        self._input_count = setting.parameter_count // self._neuron_count - self._neuron_count - 1
        self._random = Chance(setting.seed)
        neat = library("neat")
        with self._random.drawn():
            self._population: Any = neat.Population(self._config(neat, setting, options))
        self._favourite = self.ask()[0]

    def _config(self, neat: Any, setting: Setting, options: Options) -> Any:
        """Return the settings of the library, which it reads from a file."""
        most = self._neuron_count

        class Genome(neat.DefaultGenome):  # type: ignore[misc] # a class of a library that is not annotated
            """A genome that grows no more neurons than the controller has."""

            def mutate_add_node(self, config: Any) -> None:
                if len(self.nodes) < most:
                    super().mutate_add_node(config)

        spread = setting.spread
        genome: dict[str, Any] = {
            "num_inputs": self._input_count,
            "num_outputs": 2,
            "num_hidden": 0,
            "feed_forward": False,
            "initial_connection": "full_direct",
            "conn_add_prob": options.add_connection,
            "conn_delete_prob": options.remove,
            "node_add_prob": options.add_neuron,
            "node_delete_prob": options.remove,
            "single_structural_mutation": False,
            "structural_mutation_surer": "default",
            "compatibility_disjoint_coefficient": 1.0,
            "compatibility_weight_coefficient": 1.2 / spread,
            "enabled_default": True,
            "enabled_mutate_rate": 0.01,
            "enabled_rate_to_true_add": 0.0,
            "enabled_rate_to_false_add": 0.0,
        }
        for name, usual in (("activation", "tanh"), ("aggregation", "sum")):
            genome |= {f"{name}_default": usual, f"{name}_options": usual, f"{name}_mutate_rate": 0.0}
        numbers = {"weight": (0.0, spread), "bias": (0.0, spread), "response": (1.0, 0.0), "time_constant": (1.0, 0.0)}
        for name, (mean, deviation) in numbers.items():
            values = {"init_mean": mean, "init_stdev": deviation, "init_type": "gaussian"}
            values |= {"min_value": mean - 1e3 * deviation, "max_value": mean + 1e3 * deviation}
            values |= {"mutate_power": options.mutation * deviation, "mutate_rate": 0.8 if deviation else 0.0}
            values |= {"replace_rate": 0.02 if deviation else 0.0}
            genome |= {f"{name}_{key}": value for key, value in values.items()}
        sections = {
            "NEAT": {
                "pop_size": setting.population,
                "fitness_criterion": "max",
                "fitness_threshold": 0.0,
                "reset_on_extinction": False,
                "no_fitness_termination": True,
            },
            "Genome": genome,
            "DefaultSpeciesSet": {"compatibility_threshold": options.threshold},
            "DefaultStagnation": {
                "species_fitness_func": "max",
                "max_stagnation": options.stagnation,
                "species_elitism": 2,  # so that not all die
            },
            "DefaultReproduction": {"elitism": 1, "survival_threshold": 0.2, "min_species_size": 1},
        }
        with TemporaryDirectory(prefix="kiks-") as folder:
            parser = ConfigParser()
            parser.read_dict(sections)
            with (file := Path(folder, "neat.ini")).open("w") as opened:
                parser.write(opened)
            kinds = (neat.DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation)
            return neat.Config(Genome, *kinds, str(file))

    def ask(self) -> Floats:
        """Return the next generation."""
        return np.array([self._parameters(each) for each in self._population.population.values()])

    def _parameters(self, genome: Any) -> Floats:
        """Return a network as the parameters of the controller, float64 [parameter]."""
        neurons = [0, 1, *sorted(key for key in genome.nodes if key > 1)]
        place = {key: number for number, key in enumerate(neurons, 1 + self._input_count)}
        place |= {-1 - number: 1 + number for number in range(self._input_count)}
        rows = np.zeros((1 + self._input_count + self._neuron_count, self._neuron_count))
        for neuron, key in enumerate(neurons):
            rows[0, neuron] = genome.nodes[key].bias
        for (sender, receiver), connection in genome.connections.items():
            if connection.enabled:
                rows[place[sender], place[receiver] - 1 - self._input_count] = connection.weight
        return rows.ravel()

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        self._favourite = self.ask()[fitness.argmax()]

        def assign(genomes: Any, config: Any) -> None:
            for (_, genome), value in zip(genomes, fitness.tolist(), strict=True):
                genome.fitness = value

        with self._random.drawn():
            self._population.run(assign, 1)

    def favourite(self) -> Floats:
        """Return the best of the last generation."""
        best: Floats = self._favourite.copy()
        return best


class Diverse:
    """Finds many behaviours: new candidates come from an archive of those that differ. pyribs keeps it and proposes.

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
        inside = np.clip(
            behaviours[:, : self._axis_count], self._low, self._high
        )  # what lies beyond an end is nothing new
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
    """CMA-ME: several CMA-ES that follow what improves the map most; each begins again at an elite when it finds none.

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
    """What pyribs ranks candidates by, which of them it follows, and when a strategy begins again."""

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


ALGORITHMS: dict[str, Any] = {
    AlgorithmName.CMA.value: Cma,
    AlgorithmName.GA.value: Ga,
    AlgorithmName.SGA.value: Sga,
    AlgorithmName.NSGA2.value: Nsga2,
    AlgorithmName.NEAT.value: Neat,
    AlgorithmName.MAP_ELITES.value: MapElites,
    AlgorithmName.CMA_ME.value: CmaMe,
    AlgorithmName.NOVELTY.value: Novelty,
}
"""The algorithms by their names; `Options` of each are what stands behind the colon."""


def options_of(algorithm: str) -> Any:
    """Return the options of an algorithm, such as 'cma' or 'cma:separable=true'.

    Example:
        >>> options_of("cma:separable=true").restarts
        'none'
    """
    name, options = parts_of(algorithm)
    try:
        return ALGORITHMS[name].Options(**options)
    except ParameterError as error:
        raise ParameterError(f"algorithm {name}: {error}") from None


def whole_name(algorithm: str) -> str:
    """Return the text of an algorithm that is the same for the same options, without those that are as usual.

    Example:
        >>> whole_name("sga:crossover=0.60,bits=8")
        'sga:bits=8'
    """
    return text_of(parts_of(algorithm)[0], table_of(options_of(algorithm)))


def make_algorithm(algorithm: str, setting: Setting) -> Algorithm:
    """Return an algorithm, such as 'cma' or 'cma:separable=true'."""
    name, _ = parts_of(algorithm)
    made: Algorithm = ALGORITHMS[name](setting, options_of(algorithm))
    return made
