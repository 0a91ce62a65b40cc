"""The toolbox is valid MATLAB, as far as can be told without MATLAB: MISS_HIT parses it, and each function is MATLAB's.

`mh_lint` and `mh_style` check grammar and style (`make lint`). Here stands what they do not look at: whether the
functions that are called exist in MATLAB.
"""

import functools
from pathlib import Path

from miss_hit_core.config import Config
from miss_hit_core.errors import Message_Handler
from miss_hit_core.m_ast import (
    AST_Visitor,
    For_Loop_Statement,
    Function_Call,
    Function_Definition,
    Function_Signature,
    Global_Statement,
    Identifier,
    Lambda_Function,
    Node,
    Persistent_Statement,
    Selection,
    Simple_Assignment_Statement,
    String_Literal,
    Try_Statement,
)
from miss_hit_core.m_language import MATLAB_2020b_Language
from miss_hit_core.m_language_builtins import BUILTIN_FUNCTIONS, HIGH_IMPACT_BUILTIN_FUNCTIONS
from miss_hit_core.m_lexer import MATLAB_Lexer
from miss_hit_core.m_parser import MATLAB_Parser
from tests.matlab.octave import DEMOS, TOOLBOX

FILES = sorted(TOOLBOX.rglob("*.m"))

WRITTEN_IN_MATLAB = """
    addpath angle axis bar datestr fileparts fileread fullfile gca help hold ind2sub inpolygon ispc isunix linspace
    mat2str mean meshgrid now onCleanup path pathsep pwd read rmfield rmpath serialport setdiff start stop
    str2double strcat strjoin strsplit strtok tcpclient tempname timer title union unique write xlabel ylabel
"""
"""Functions of MATLAB R2020b that the toolbox calls and MISS_HIT does not list: it knows only those that are built in.
Look a function up in MATLAB's documentation before you add it."""

OCTAVE_ONLY = {
    "F_SETFL": {"simulator_link"},
    "O_NONBLOCK": {"simulator_link"},
    "add_input_event_hook": {"poll_desk"},
    "canonicalize_file_name": {"robot_port"},
    "fclear": {"robot_port", "simulator", "simulator_link"},
    "fcntl": {"simulator_link"},
    "fflush": {"evaluate_typed", "kiks_status", "robot_port", "simulator", "simulator_link"},
    "fputs": {"simulator", "simulator_link"},
    "have_window_system": {"has_display"},
    "nproc": {"simulator_link"},
    "pkg": {"robot_port"},
    "popen2": {"simulator_link"},
    "remove_input_event_hook": {"poll_desk"},
    "stdout": {"evaluate_typed", "kiks_status"},
    "waitpid": {"simulator_link"},
}
"""Functions that only Octave has, and the files that call them, in branches that only Octave takes."""

MATLAB_ONLY = {"feature": {"has_display"}}
"""The same for MATLAB."""


class Names(AST_Visitor):
    """Collects the names of a file.

    Attributes:
        used: All names except those of fields.
        variables: The names of variables.
        functions: The functions that are defined in the file.
        slips: What MATLAB takes for a command (`x += 1`), a shell escape (`!x`) or a string (`"x"`).
    """

    def __init__(self) -> None:
        self.used: set[str] = set()
        self.variables: set[str] = set()
        self.functions: set[str] = set()
        self.slips: set[str] = set()

    def visit(self, node: Node, n_parent: Node, relation: str) -> None:
        match node:
            case Identifier():
                if not (isinstance(n_parent, Selection) and relation == "Field"):
                    self.used.add(str(node))
            case Function_Call() if node.variant != "normal" and str(node.n_name) != "clear":
                self.slips.add(str(node))
            case String_Literal():
                self.slips.add(str(node))
            case Function_Definition():
                self.functions.add(str(node.n_sig.n_name))
            case Function_Signature():
                self._declare(*node.l_inputs, *node.l_outputs)
            case Simple_Assignment_Statement():
                self._declare(node.n_lhs)
            case For_Loop_Statement():
                self._declare(node.n_ident)
            case Global_Statement() | Persistent_Statement():
                self._declare(*node.l_names)
            case Lambda_Function():
                self._declare(*node.l_parameters)
            case Try_Statement() if node.n_ident is not None:
                self._declare(node.n_ident)
            case _ if hasattr(node, "l_lhs"):  # [a, b] = f()
                self._declare(*node.l_lhs)

    def _declare(self, *targets: Node) -> None:
        for target in targets:
            # a.b(3).c = 1 makes a variable a.
            while not isinstance(target, Identifier):
                target = getattr(target, "n_prefix", None) or target.n_ident
            self.variables.add(str(target))


def names_of(file: Path) -> Names:
    """Parse a file as MATLAB R2020b."""
    return names_in(file.read_text(encoding="utf-8"), str(file))


@functools.cache
def names_in(text: str, file: str) -> Names:
    messages = Message_Handler("debug")
    messages.register_file(file)
    lexer = MATLAB_Lexer(MATLAB_2020b_Language(), messages, text, file)
    tree = MATLAB_Parser(messages, lexer, Config()).parse_file()
    names = Names()
    tree.visit(None, names, "Root")
    return names


def test_every_function_is_one_of_matlab_or_of_the_toolbox() -> None:
    known = BUILTIN_FUNCTIONS | HIGH_IMPACT_BUILTIN_FUNCTIONS | set(WRITTEN_IN_MATLAB.split()) | {"end"}
    wrong = []
    for file in FILES:
        folders = {TOOLBOX, DEMOS, file.parent, file.parent / "private"}
        ours = {each.stem for folder in folders for each in folder.glob("*.m")}
        names = names_of(file)
        named_here = ours | names.functions | names.variables
        here_alone = {name for name, files in (OCTAVE_ONLY | MATLAB_ONLY).items() if file.stem in files}
        unknown = names.used - known - named_here - here_alone
        wrong += [f"{file.relative_to(TOOLBOX)}: {name}" for name in (*unknown, *names.slips)]
    assert not wrong, "\n".join(wrong)


def test_the_lists_name_only_what_is_called() -> None:
    used = {file.stem: names_of(file).used for file in FILES}
    assert set().union(*used.values()) >= set(WRITTEN_IN_MATLAB.split())
    for name, files in (OCTAVE_ONLY | MATLAB_ONLY).items():
        assert {file for file in files if name in used[file]} == files


def test_functions_that_matlab_lacks_are_noticed() -> None:
    names = names_in("function wrong()\nx.y = 3;\nprintf('%d', x.y, columns(x));\nend\n", "wrong.m")
    assert names.used - names.variables - {"wrong"} == {"printf", "columns"}
    assert len(names_in('function wrong()\nx = "a";\nx += 1;\nif x != 3, x = 1; end\nend\n', "wrong.m").slips) == 3
