"""The site: `make docs` builds it into build/docs, offline, with warnings as errors."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import typing
from html import escape
from pathlib import Path

from sphinx.ext.napoleon import GoogleDocstring

import kiks

sys.path.insert(0, str(Path(__file__).with_name("pages")))
import commands
import files
import gallery

project = "KiKS"
copyright = "KiKS contributors"
version = release = kiks.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
]
# What is for developers only, and the programs that make pages.
exclude_patterns = ["next.md", "pages", "gallery/**/GALLERY_HEADER.rst", "gallery/**/*.ipynb"]

# A reference to something of KiKS must lead somewhere. Those to other libraries would need the network.
nitpicky = True
nitpick_ignore_regex = [("py:.*", r"(?!kiks\.).*|kiks\.(?!controllers|measures|tasks)[a-z_]+\..*")]

myst_heading_anchors = 3

# Notebooks run at each build, so that their pages show what a reader will see; tests/test_notebooks.py runs them, too.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_typehints_format = "short"
napoleon_use_rtype = False
napoleon_use_ivar = True
default_role = "code"

gallery.prepare()
sphinx_gallery_conf = {
    "examples_dirs": "../build/gallery",
    "gallery_dirs": gallery.PAGES,
    "filename_pattern": "",
    "parallel": os.cpu_count(),
    "abort_on_example_error": True,
    "image_scrapers": ("gallery.keep_pictures",),
    "capture_repr": (),
    "subsection_order": [f"../build/gallery/{name}" for name in ("scripts", "demonstrations", "exercises")],
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
}

html_theme = "furo"
html_title = f"KiKS {release}"
html_favicon = "images/icon.svg"
html_static_path, html_css_files = ["style"], ["gallery.css"]
templates_path = ["templates"]


# Types in signatures are without the rules of Pydantic, which texts say.
_hints = typing.get_type_hints
typing.get_type_hints = lambda *args, include_extras=False, **options: _hints(*args, **options)

PUBLIC = {
    f"{each.__module__}.{each.__name__}": f"kiks.{each.__name__}"
    for each in (getattr(kiks, name) for name in kiks.__all__)
    if isinstance(each, type)
}
"""For the place of each public class the name that users write."""


def lead_to_public_names(app, env, node, contnode):
    """Lead a type in a signature to its public name."""
    name = PUBLIC.get(node.get("reftarget"))
    if name is not None:
        domain = env.domains.python_domain
        return domain.resolve_xref(env, node["refdoc"], app.builder, "class", name, node, contnode)


HERE = Path(__file__).parent
QUESTIONS = (HERE / "how_do_i.md").read_text(encoding="utf-8")

LISTS = {"how_do_i", "index"}
"""Pages that lead to others: the search does not find them."""

PAGES = {
    re.search("^# (.+)", path.read_text(encoding="utf-8"), re.MULTILINE)[1]: path.relative_to(HERE)
    .with_suffix("")
    .as_posix()
    for path in HERE.glob("*/*.md")
}
"""For the title of each page, by which docstrings name it, its place."""


ARRAY = re.compile(r"~?[\w.]*\bndarray\[~?\w+\[~?[\w.]+, \.\.\.\], ~?[\w.]*\bdtype\[(~?[\w.]+)\]\]")


def shorten_arrays(app, what, name, *_):
    """Write arrays as the code does."""
    kinds = app.env.current_document.autodoc_annotations.get(name, {})
    kinds.update({key: ARRAY.sub(r"NDArray[\1]", kind) for key, kind in kinds.items()})


def prepare(app, what, name, obj, options, lines):
    """Read the sections of properties and measures, whose first line napoleon takes for a type, and link pages."""
    if what in ("property", "attribute", "data"):
        lines[:] = ["..", "", *GoogleDocstring(lines, app.config, app, "function", name, obj, options).lines()]
    lines[:] = [re.sub('page "(.+?)"', lambda found: f"page :doc:`/{PAGES[found[1]]}`", line) for line in lines]


SCROLLED = re.compile(r'<pre(?=[ >])|<div(?= class="table-wrapper)')
SECTION = re.compile(r'<section id="([^"]+)">((?:\s*<span id="[^"]+"></span>)*\s*<h[1-6])>')


def help_readers_and_keys(app, page, template, context, doctree):
    """Give captions of the list of pages their level for readers of screens; let keys reach what can be scrolled."""
    tree = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')
    body = SCROLLED.sub(r'\g<0> tabindex="0"', context.get("body", ""))
    # The search leads to headings that have the address themselves, where Sphinx gives it to the section.
    context["body"] = SECTION.sub(r'<section>\2 id="\1">', body)


NOT_SEARCHED = ".headerlink, .genindextable, .indextable, .genindex-jumpbox"
"""What the search leaves out of a page."""

QUESTION = re.compile(r"^### \.\.\. (.+)\n<!-- (.+) -->\n.*?\]\(([\w/]+)\.(?:md|rst)", re.MULTILINE)
"""A question of `how_do_i.md`, other words for it, and the page that its first link leads to."""


def add_questions(app, page, template, context, doctree):
    """Give the search the questions that a page answers, in the words of those who ask."""
    if page in LISTS:
        context["body"] = f'<div data-pagefind-ignore="all">{context["body"]}</div>'
    asked = [
        f"How do I {question} {words}" for question, words, answer in QUESTION.findall(QUESTIONS) if answer == page
    ]
    if asked:
        text = escape(". ".join(asked))
        context["body"] += f'<p hidden data-pagefind-meta="asked" data-pagefind-weight="5">{text}</p>'


def make_search(app, fault):
    """Index the site for its search."""
    if fault is None and app.builder.name == "html":
        shutil.rmtree(app.outdir / "pagefind", ignore_errors=True)
        command = [sys.executable, "-m", "pagefind", "--quiet", "--site", app.outdir]
        command += ["--root-selector", "article[role=main]", "--exclude-selectors", NOT_SEARCHED]
        subprocess.run(command, check=True)


def write_pages(app):
    """Write the pages that are made from what commands and files say of themselves, if they have changed; notebooks."""
    shutil.copytree(gallery.ROOT / "examples" / "notebooks", Path(app.srcdir) / "notebooks", dirs_exist_ok=True)
    for name, made in {"commands": commands.page(), "files": files.page()}.items():
        path = Path(app.srcdir) / "reference" / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != made:
            path.write_text(made, encoding="utf-8")


def setup(app):
    """Connect the functions above; `prepare` comes before napoleon, and `help_readers_and_keys` after the theme."""
    app.connect("builder-inited", write_pages)
    app.connect("html-page-context", help_readers_and_keys, priority=900)
    app.connect("html-page-context", add_questions)
    app.connect("build-finished", make_search)
    app.connect("missing-reference", lead_to_public_names)
    app.connect("autodoc-process-signature", shorten_arrays, priority=600)
    app.connect("autodoc-process-docstring", prepare, priority=400)
