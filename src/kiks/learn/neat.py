"""NEAT, by the library neat-python."""

from __future__ import annotations

from configparser import ConfigParser
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from kiks.errors import ParameterError, library
from kiks.learn.algorithm import Floats, Positive, Setting, Share
from kiks.learn.chance import SeededRandom
from kiks.learn.genetic import Genetic
from kiks.model.data_file import Whole, record


class Neat(Genetic):
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
        self._random = SeededRandom(setting.seed)
        neat = library("neat")
        with self._random.drawn():
            self._population: Any = neat.Population(self._config(neat, setting, options))
        self._fittest = self.ask()[0]

    def _config(self, neat: Any, setting: Setting, options: Options) -> Any:
        """Return the settings of the library, which it reads from a file."""
        most = self._neuron_count

        class Genome(neat.DefaultGenome):  # type: ignore[misc] # a class of a library that is not annotated
            """A genome that grows no more neurons than the controller has."""

            def mutate_add_node(self, config: Any) -> None:
                if len(self.nodes) < most:  # beyond it the controller has no parameters
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
            "enabled_mutate_rate": 0.01,  # a disabled connection is a weight of 0
            "enabled_rate_to_true_add": 0.0,
            "enabled_rate_to_false_add": 0.0,
        }
        for name, usual in (("activation", "tanh"), ("aggregation", "sum")):
            genome |= {f"{name}_default": usual, f"{name}_options": usual, f"{name}_mutate_rate": 0.0}
        # A deviation of 0 keeps what the controller has no parameters for: gains and time constants of neurons.
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
        neurons = [0, 1, *sorted(key for key in genome.nodes if key > 1)]  # outputs first: they are the wheels
        place = {key: number for number, key in enumerate(neurons, 1 + self._input_count)}
        place |= {-1 - number: 1 + number for number in range(self._input_count)}  # the library numbers inputs from -1
        rows = np.zeros((1 + self._input_count + self._neuron_count, self._neuron_count))
        for neuron, key in enumerate(neurons):
            rows[0, neuron] = genome.nodes[key].bias
        for (sender, receiver), connection in genome.connections.items():
            if connection.enabled:
                rows[place[sender], place[receiver] - 1 - self._input_count] = connection.weight
        return rows.ravel()

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        self._fittest = self.ask()[fitness.argmax()]

        # The library evaluates by a callback: here the values are known already, in the order of `ask`.
        def assign(genomes: Any, config: Any) -> None:
            for (_, genome), value in zip(genomes, fitness.tolist(), strict=True):
                genome.fitness = value

        with self._random.drawn():
            self._population.run(assign, 1)
