"""The toolbox is valid MATLAB, as far as can be told without MATLAB: MISS_HIT parses it, and each function is MATLAB's.

`mh_lint` and `mh_style` check grammar and style (`make lint`). Here stands what they do not look at: whether the
functions that are called exist in MATLAB.
"""

import functools
from pathlib import Path

from miss_hit_core import m_ast
from miss_hit_core.config import Config
from miss_hit_core.errors import Message_Handler
from miss_hit_core.m_language import MATLAB_2020b_Language
from miss_hit_core.m_language_builtins import BUILTIN_FUNCTIONS, HIGH_IMPACT_BUILTIN_FUNCTIONS
from miss_hit_core.m_lexer import MATLAB_Lexer
from miss_hit_core.m_parser import MATLAB_Parser
from tests.matlab.octave import DEMOS, TOOLBOX

FILES = sorted(TOOLBOX.rglob("*.m"))

WRITTEN_IN_MATLAB = """
    addpath angle axis bar datenum datetime datevec fileparts fileread fullfile gca help hold ind2sub
    inpolygon ispc isunix linspace mat2str mean meshgrid now onCleanup path pathsep posixtime pwd read rmfield
    rmpath serialport setdiff start stop str2double strcat strjoin strsplit strtok tcpclient tempname timer title
    union unique write xlabel ylabel
"""
"""Functions of MATLAB R2020b that the toolbox calls and MISS_HIT does not list: it knows only those that are built in.
Look a function up in MATLAB's documentation before you add it."""

OCTAVE_ONLY = {
    "clock": {"localtime"},
    "evaluate_typed": {"fflush", "stdout"},
    "has_display": {"have_window_system"},
    "kiks_status": {"fflush", "localtime", "stdout", "strftime"},
    "poll_desk": {"add_input_event_hook", "remove_input_event_hook"},
    "robot_port": {"canonicalize_file_name", "fclear", "fflush", "pkg"},
    "run_program": {"page_output_immediately", "page_screen_output", "rande", "randg", "randp", "source", "stat"}
    | {"stderr", "stdin"},
    "simulator": {"fclear", "fflush", "fputs", "isdebugmode"},
    "simulator_link": {"F_SETFL", "O_NONBLOCK", "fclear", "fcntl", "fflush", "fputs", "nproc", "popen2", "waitpid"},
}
"""Files that call functions that only Octave has, in branches that only Octave takes."""

MATLAB_ONLY = {"has_display": {"feature"}}
"""The same for MATLAB."""


class Names(m_ast.AST_Visitor):
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

    def visit(self, node: m_ast.Node, n_parent: m_ast.Node, relation: str) -> None:
        match node:
            case m_ast.Identifier():
                if not (isinstance(n_parent, m_ast.Selection) and relation == "Field"):
                    self.used.add(str(node))
            case m_ast.Function_Call() if node.variant != "normal" and str(node.n_name) != "clear":
                self.slips.add(str(node))
            case m_ast.String_Literal():
                self.slips.add(str(node))
            case m_ast.Function_Definition():
                self.functions.add(str(node.n_sig.n_name))
            case m_ast.Function_Signature():
                self._declare(*node.l_inputs, *node.l_outputs)
            case m_ast.Simple_Assignment_Statement():
                self._declare(node.n_lhs)
            case m_ast.For_Loop_Statement():
                self._declare(node.n_ident)
            case m_ast.Global_Statement() | m_ast.Persistent_Statement():
                self._declare(*node.l_names)
            case m_ast.Lambda_Function():
                self._declare(*node.l_parameters)
            case m_ast.Try_Statement() if node.n_ident is not None:
                self._declare(node.n_ident)
            case _ if hasattr(node, "l_lhs"):  # [a, b] = f()
                self._declare(*node.l_lhs)

    def _declare(self, *targets: m_ast.Node) -> None:
        for target in targets:
            # a.b(3).c = 1 makes a variable a.
            while not isinstance(target, m_ast.Identifier):
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
        unknown = (
            names.used - known - named_here - OCTAVE_ONLY.get(file.stem, set()) - MATLAB_ONLY.get(file.stem, set())
        )
        wrong += [f"{file.relative_to(TOOLBOX)}: {name}" for name in (*unknown, *names.slips)]
    assert not wrong, "\n".join(wrong)


def test_the_lists_name_only_what_is_called() -> None:
    used = {file.stem: names_of(file).used for file in FILES}
    assert set().union(*used.values()) >= set(WRITTEN_IN_MATLAB.split())
    for file, names in (*OCTAVE_ONLY.items(), *MATLAB_ONLY.items()):
        assert names <= used[file], file


def test_functions_that_matlab_lacks_are_noticed() -> None:
    names = names_in("function wrong()\nx.y = 3;\nprintf('%d', x.y, columns(x));\nend\n", "wrong.m")
    assert names.used - names.variables - {"wrong"} == {"printf", "columns"}
    assert len(names_in('function wrong()\nx = "a";\nx += 1;\nif x != 3, x = 1; end\nend\n', "wrong.m").slips) == 3
