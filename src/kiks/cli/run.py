"""`kiks run`."""

from __future__ import annotations

import gc
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.debug import PORT, Debugging, DebugPort, WithDebugger
from kiks.cli.desk import NoWait, WithDesk, desk_for, open_desk
from kiks.cli.engine_start import ready_engine
from kiks.cli.job import Job, job_of, takes_options_behind
from kiks.cli.join import run_joined
from kiks.cli.options import Silence, WorldOptions, say, show_log
from kiks.cli.outputs import Command as CheckedCommand
from kiks.cli.outputs import has_results, leave_out, output, tell_results
from kiks.cli.record import ExportFile, RecordFile, noting_output, recorded, tell_run
from kiks.ending import INTERRUPTED, end_as_with_ctrl_c
from kiks.errors import ParameterError, shown
from kiks.model.checks import SECONDS_MAX, check_number
from kiks.model.replaceable import THINKING

if TYPE_CHECKING:
    from kiks.ports.program_command import ProgramCommand
    from kiks.ports.programs import Programs
    from kiks.run import Run
    from kiks.sim.simulation import Simulation


class RunCommand(CheckedCommand):
    """Also takes options after a project or a champion, which have no arguments of their own, unlike programs."""

    allow_interspersed_args = False  # all words after a program's name or -m belong to the program

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Move options after such a file before it, and mark where the words of programs begin."""
        if ctx.resilient_parsing:
            return super().parse_args(ctx, args)
        options, words = self._split(ctx, args)
        if "--debug" in options and words[:1] and words[0].isdecimal():
            more, words = self._split(ctx, words[1:])
            options += [f"--debug-port={args[len(options)]}", *more]
        if words and takes_options_behind(words[0]):
            behind, others = self._split(ctx, words[1:])
            options, words = options + behind, [words[0], *others]
        elif "--" not in options:
            self._say_what_programs_get(words)
        options = [word for word in options if word != "--"]
        return super().parse_args(ctx, [*options, "--", *words] if words else options)

    def _say_what_programs_get(self, words: list[str]) -> None:
        """Say that an option of ours behind a program is its own, as with `python`: it may be meant for us."""
        ours = {name for param in self.params for name in param.opts}
        for word in words[1:]:
            if word.partition("=")[0] in ours:
                say(
                    f"{word} goes to {words[0]}, as all words behind a program. Is it for KiKS? Then put it before the "
                    "program. If not, -- before the program says so."
                )

    def _split(self, ctx: Any, args: list[str]) -> tuple[list[str], list[str]]:
        """Return the options at the beginning, and the words after them."""
        end = next((place for place, word in enumerate(args) if word.split(" ", 1)[0] == "-m"), len(args))
        found, _, _ = self.make_parser(ctx).parse_args(args[:end])
        begin = end - int(found.get("program") is not None) - len(found.get("arguments") or ())
        return args[:begin], args[begin:]


def _names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the demonstrations for a shell that completes `kiks demo`; programs are files, which it knows itself."""
    from kiks.model.shipped import demonstrations

    return [name for name in demonstrations() if name.startswith(incomplete)] if ctx.info_name == "demo" else []


@has_results
def run(
    context: typer.Context,
    world: WorldOptions,
    silence: Silence,
    program: Annotated[
        Path,
        typer.Argument(
            help="A Python program that talks to a Khepera through pyserial: a file (.py), a notebook (.ipynb), a "
            "folder with a __main__.py, or -m and the name of a module; or a program of Octave (.m), a project "
            "(.kiks), a demonstration, or a champion's file or folder.",
            autocompletion=_names,
        ),
    ],
    arguments: Annotated[
        list[str] | None,
        typer.Argument(
            help="The program's arguments; each program's file, and each quoted '-m MODULE', begins another."
        ),
    ] = None,
    thinking: Annotated[
        str | None,
        typer.Option(
            help="Thinking time of the program: none, fixed:MS, live, live:FACTOR, replay:FILE; a project's own, else "
            "none, if left out."
        ),
    ] = None,
    map_: Annotated[
        list[str] | None,
        typer.Option(
            "--map", help="Port name or address, and robot, like COM1=1 or 10.0.0.2:23=1; else in the order of opening."
        ),
    ] = None,
    save_thinking: Annotated[
        Path | None,
        typer.Option(
            help="Write the thinking times of a live run here, for replay:FILE.", callback=output(kind=THINKING)
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            help="Simulated time at which the run ends [s]; that of the project or champion, if it has one, if left "
            "out."
        ),
    ] = None,
    max_wall: Annotated[
        float | None,
        typer.Option(help="Real time after which the run ends [s], whatever runs; exit code 124, and not repeatable."),
    ] = None,
    record: RecordFile = None,
    export: ExportFile = None,
    desk: WithDesk = False,
    debug: WithDebugger = False,
    debug_port: DebugPort = PORT,
    no_wait: NoWait = False,
    join: Annotated[
        str | None,
        typer.Option(help="Drive a robot on another computer, by the address that kiks host prints there."),
    ] = None,
) -> None:
    """Run a program for a real robot on a simulated one, unchanged.

    Its serial ports lead to simulated robots, and its clocks show simulated time, so its waits take no real time.
    Several programs share a world, each in a process of its own: the first drives robot 1, the second robot 2, and so
    on. Options for KiKS stand before the program; what follows it belongs to it.

    A project (.kiks) has its own world, robots and programs; programs after it replace its own, from robot 1 on. With a
    file or folder of `kiks evolve`, its champion drives all robots, in its own world or in --arena. Demonstrations are
    projects that come with KiKS, and leave a picture: avoid, battle, camera, clean, epuck_avoid, epuck_formation,
    epuck_light, epuck_line, first_steps, follow, hide_and_seek, maze, pictures, race, soccer, square, sumo, swarm,
    to_the_light.

    Example: kiks run --arena maze --map /dev/ttyUSB0=1 wander.py
    """
    show_log()
    if join is not None:
        others = {param.name or "" for param in context.command.params} - {"program", "arguments", "join"}
        leave_out(context, "with --join, as the host has the world", *others)
        raise typer.Exit(run_joined(join, [str(program), *(arguments or [])]))
    if desk:
        leave_out(context, "with --desk, whose editor has a debugger", "debug")
    if not (desk or debug):
        leave_out(context, "without --desk or --debug", "no_wait")
    if desk:
        leave_out(context, "with --desk, where a person ends the run", "max_wall", "seconds", "json")
    job = job_of(str(program), arguments or [], world, needs_program=not desk)
    if seconds is not None:
        check_number("--seconds", seconds, 0, SECONDS_MAX)
    if max_wall is not None:
        check_number("--max-wall", max_wall, 0.001, 1e7, "Take 60.")
    mapping = dict(parse_map(entry) for entry in map_ or [])
    rules = silence.rules()
    import kiks.script  # noqa: F401  (under an interpreter that it does not know, KiKS ends here)
    from kiks.sim.from_project import thinking_of
    from kiks.sim.world import index_of_robot

    is_alone = len(job.commands) == 1 and not desk
    thinking = thinking_of(job.project, job.home) if thinking is None else thinking
    if not thinking.startswith("live"):
        leave_out(context, f"with --thinking {thinking}", "save_thinking")
    if is_alone:
        leave_out(context, "with one program", "when_silent", "patience")
    for number in mapping.values():
        index_of_robot(number, len(job.project.robots))
    # A program may change the working folder.
    thoughts = None if save_thinking is None else save_thinking.absolute()
    rules |= {"robots_by_name": mapping, "record": thoughts}
    if desk:
        _run_on_desk(job, thinking, rules, record=record, export=export, waits=not no_wait)
        return
    for each in filter(None, job.commands):
        each.check_file()
        if debug and not each.runs_here:
            raise ParameterError(
                f"--debug must follow programs of Python, but {each.name} is one of Octave. Its own debugger stops it: "
                "write keyboard into it."
            )
    ready = partial(ready_engine, as_needed=is_alone and job.needs_little)
    debugging = Debugging(debug_port, waits=not no_wait) if debug else None
    while True:
        run = job.run(thinking=thinking, ready=ready, **rules)
        if seconds is not None:
            run.seconds = seconds
        # What is loaded by now stays to the end of the process: no collection looks at it again, not even those at the
        # end, which would take a third of the time of a short run.
        gc.freeze()
        with recorded(run.sim, record, export, run.files, run.project.goal), run:
            for doubt in run.supervise().doubts:
                say(doubt)
            end_as_with_ctrl_c()
            code = _run_to_end(context, run, max_wall, debugging)
        if debugging is None or not debugging.goes_again:
            break
    if code == 0 and run.sim.now_ns == 0:
        say(
            "nothing was sent to a robot, and no time has passed. A program reaches its robot through a serial port, "
            'as in kiks.Khepera("/dev/ttyUSB0"). One that makes a world of its own runs with python, without kiks run.'
        )
    if job.demonstration:
        say(f"picture: {export}")
    raise typer.Exit(code)


def _run_to_end(context: typer.Context, run: Run, max_wall_s: float | None, debugging: Debugging | None) -> int:
    """Run the programs, tell how it has ended, also if it is interrupted, and return the exit code."""
    from kiks.run import WALL

    doubt, code = "", INTERRUPTED
    try:
        if debugging is None and len(run.commands) == 1 and run.commands[0] is not None and run.commands[0].runs_here:
            code = _run_here(run, run.commands[0], max_wall_s)
            doubt = run.sim.program.doubt
        else:
            programs = _programs(run, debugging)
            with run.limited(programs.end, programs.end_soon, wall_s=max_wall_s):
                code = programs.run()
            doubt = programs.doubt
        if run.ended_by == WALL:
            doubt = f"{WALL} has ended it"
        return code
    except KeyboardInterrupt:
        doubt = "it was interrupted"
        raise
    finally:
        if debugging is None or not debugging.goes_again:
            tell_results(context, tell_run(run.sim, run.thinking, doubt) | _judged(run))
            if debugging is not None:
                debugging.close(code)


def _programs(run: Run, debugging: Debugging | None) -> Programs:
    """Make what runs the programs, in processes of their own; one alone tells its end itself."""
    from kiks.ports.program_output import Labels

    names = [each.name for each in run.commands if each is not None]
    labels = Labels(names) if len(names) > 1 else None
    is_alone = len(run.commands) == 1
    tell = labels.say if labels is not None else (lambda text: None) if is_alone else say
    take = run.take_programs if debugging is None else partial(debugging.take_programs, run)
    return take(say=tell, labels=labels)


def _judged(run: Run) -> dict[str, Any]:
    """Say how the run has done, if its project has a goal, and return it."""
    if run.supervision is None or run.supervision.judge is None:
        return {}
    say(run.supervision.decide())
    return {"goal": vars(run.supervision.judge.end())}


def _run_on_desk(
    job: Job, thinking: str, rules: dict[str, Any], *, record: Path | None, export: Path | None, waits: bool
) -> None:
    """Run programs in processes of their own in a world on the desk, until Ctrl-C.

    Args:
        job: What is run.
        thinking: Thinking time of the programs.
        rules: Other options of `Programs`.
        record: See `recorded`.
        export: See `recorded`.
        waits: See `open_desk`.
    """
    from kiks.desk.server.rights import Rights
    from kiks.ports.program_output import Labels

    # Only the command line can name a replay that lies anywhere: no project holds that.
    if not thinking.startswith("replay"):
        job = replace(job, project=replace(job.project, thinking=thinking))
    labels = Labels([each.name for each in job.commands if each is not None] or [""])
    desk = desk_for(job, Rights.OWNER, thinking=thinking, say=labels.say, labels=labels, **rules)

    def end(sim: Simulation) -> None:
        if not desk.programs.was_touched:
            # The page shows the last state until a person lets time pass.
            desk.present.gate.pause(sim.now_ns)
            tell_run(sim, desk.run.thinking, desk.programs.doubt)

    # A new start makes another world: the recording ends with the first one.
    with recorded(desk.sim, record, export, desk.run.files, desk.run.project.goal):
        open_desk(desk, waits=waits, programs_ended=end)


def _run_here(run: Run, command: ProgramCommand, max_wall_s: float | None) -> int:
    """Run a program in this process; return its exit code."""
    from kiks.script.runner import run_here

    try:
        with noting_output(run.sim):
            return run_here(
                run.sim,
                command.program,
                command.arguments,
                run.rules["robots_by_name"],
                module=command.module,
                limited=partial(run.limited, wall_s=max_wall_s),
            )
    finally:
        if (file := run.rules["record"]) is not None:
            from kiks.clock.thinking import save_thinking

            save_thinking(run.sim.program.measured_ns, file)


def parse_map(entry: str) -> tuple[str, int]:
    """Return port name and robot of '/dev/ttyS0=1'.

    Example:
        >>> parse_map("/dev/ttyS0=1")
        ('/dev/ttyS0', 1)
    """
    name, equals, number = entry.rpartition("=")
    if not (equals and name and number.isascii() and number.isdigit()):
        raise ParameterError(
            f"--map must be a port's name, = and a robot's number, but it was {shown(entry)}. Example: /dev/ttyUSB0=1."
        )
    return name, int(number)
