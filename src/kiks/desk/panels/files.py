"""Opening and saving: files of the desk's folder, examples, uploads, downloads and films."""

from __future__ import annotations

import asyncio
from pathlib import Path, PurePosixPath
from weakref import WeakMethod

from nicegui import ui
from nicegui.events import UploadEventArguments

from kiks.desk.panels.exercise_dialog import ExerciseDialog, Template
from kiks.desk.panels.film import FilmDialog
from kiks.desk.panels.widgets import NumberField, agrees, named, select, text_button, with_props
from kiks.desk.server.desk import Desk
from kiks.desk.server.folder import OPENED, PICTURES, Folder, decode, encode
from kiks.desk.server.live_editing import Editing
from kiks.errors import ParameterError
from kiks.model.limits import UPLOAD_BYTES_MAX
from kiks.model.project import Project
from kiks.model.shipped import demonstrations

Encoded = tuple[bytes, dict[str, bytes]]
"""What a file holds, and the files that have to be beside it, by name."""


class FilesPanel:
    """The controls for files.

    Args:
        desk: The desk.
        editing: Edits its world.
        template: Returns the program in the editor, with which an exercise may begin.
    """

    def __init__(self, desk: Desk, editing: Editing, template: Template) -> None:
        # Uploads start at once, so the list of waiting files is always empty. The button that chooses one has a name.
        ui.add_css(
            ".kiks-upload :is(.q-uploader__list, .q-uploader__input) { display: none }"
            ".kiks-upload .q-uploader__header { background: none; color: inherit }"
        )
        self._desk = desk
        self._editing = editing
        self._folder = Folder(desk.folder)
        self._exercise = ExerciseDialog(desk, template)
        ui.separator()
        self._build_open()
        self._build_save()
        self._build_upload()

    def _build_open(self) -> None:
        with ui.row().classes("w-full items-end no-wrap gap-1"):
            tip = f"Projects, arenas and pictures in {self._desk.folder}"
            self._choice = select("File in the folder", "open-name", [], None, tip, with_input=True)
            self._choice.classes("col").on("focus", self._list)
            text_button("Open", "folder_open", "open", "Open the world of this file", self._open)
        with ui.row().classes("w-full items-end no-wrap gap-1"):
            self._example = select("Or a demonstration", "example-name", [*demonstrations()], "avoid").classes("col")
            tip = "Open the world of this demonstration, and start its programs"
            text_button("Open", "folder_open", "open-example", tip, self._open_example)
        self._list()

    def _build_save(self) -> None:
        with ui.row().classes("w-full items-end no-wrap gap-1"):
            self._name = named(ui.input("Save as").props("dense").classes("col"), "save-name")
            self._name.tooltip("Name in the folder; .kiks saves the world, .kad an arena for the Matlab KiKS")
            text_button("Save", "save", "save", "Save the world with everything where it is now", self._save)
            text_button("", "download", "download", "Download the world under this name instead", self._download)
            tip = "Save the world as an exercise: with a text, a goal, cases and a template"
            text_button("", "school", "save-exercise", tip, self._exercise.open)
            text_button("", "movie", "film", "Make a film of the run and download it", FilmDialog(self._desk).open)

    def _build_upload(self) -> None:
        # FastAPI's cache of routes outlives the page, and the route of an upload holds its handler.
        weakly = WeakMethod(self._take)

        async def take(event: UploadEventArguments) -> None:
            if (of_this_page := weakly()) is not None:
                await of_this_page(event)

        with ui.row().classes("w-full items-center no-wrap gap-1"):
            self._upload = ui.upload(
                auto_upload=True,
                max_file_size=UPLOAD_BYTES_MAX,
                on_upload=take,
                on_rejected=lambda: ui.notify(
                    f"A file must have at most {UPLOAD_BYTES_MAX >> 20} MiB and be one of {', '.join(OPENED)}.",
                    type="negative",
                ),
            )
            self._upload.props("flat").classes("col kiks-upload")
            with self._upload.add_slot("header"):
                tip = "Upload a project, an arena, a .kad or a picture; or drop the file here"
                pick = f"() => getElement({self._upload.id}).$refs.qRef.pickFiles()"
                text_button("Upload a file", "upload", "upload-file", tip).on("click", js_handler=pick)
                ui.element("q-uploader-add-trigger")
            with_props(named(self._upload, "upload"), accept=",".join(OPENED))
            self._mm_per_pixel = NumberField("mm per pixel", "mm-per-pixel", 1.0, min=0.1, max=100, step=0.1)
            self._mm_per_pixel.classes("w-28").tooltip("Size of a pixel of an uploaded picture")

    def _list(self) -> None:
        names = self._folder.names()
        if names != self._choice.options:
            self._choice.set_options(names, value=self._choice.value if self._choice.value in names else None)

    async def _open(self) -> None:
        name = self._choice.value
        if not name:
            raise ParameterError("A file must be chosen first. Save one, or open an example.")
        path = self._folder.open(name)
        await self._open_file(name, await asyncio.to_thread(Project.load, path), path.parent)
        self._name.value = str(PurePosixPath(name).with_suffix(".kiks"))

    async def _open_example(self) -> None:
        path = demonstrations()[str(self._example.value)]
        await self._begin(await asyncio.to_thread(Project.load, path), path.parent)

    async def _open_file(self, name: str, read: Project, home: Path) -> None:
        """Begin the world of a file: a project, or an arena, to which the desk adds what is not in the file."""
        is_project = PurePosixPath(name).suffix.lower() == ".kiks"
        await self._begin(read if is_project else self._desk.project_of(read.arena), home)

    async def _begin(self, project: Project, folder: Path) -> None:
        await self._desk.replace(project, folder)
        ui.notify(f"Opened {project.arena.name}.")

    async def _encoded(self, name: str) -> Encoded:
        full = self._folder.full_name(name)
        project, beside = await self._desk.project_to_save(full)
        return await asyncio.to_thread(encode, project, full), {} if full.lower().endswith(".kad") else beside

    async def _save(self) -> None:
        name = str(self._name.value or "")
        data, beside = await self._encoded(name)
        saved = await save_in(self._folder, (data, beside), name, "a project")
        self._list()
        if saved is not None:
            also = f", with {', '.join(sorted(beside))} beside it" if beside else ""
            ui.notify(f"Saved as {saved} in {self._desk.folder}{also}.", type="positive")

    async def _download(self) -> None:
        name = PurePosixPath(self._folder.full_name(str(self._name.value or "world"))).name
        ui.download.content((await self._encoded(name))[0], name)

    async def _take(self, event: UploadEventArguments) -> None:
        try:
            name, data = event.file.name, await event.file.read()
            project = await asyncio.to_thread(decode, name, data, self._mm_per_pixel.read())
            if PurePosixPath(name).suffix.lower() in PICTURES:
                await self._editing.begin(project.arena)
            else:
                await self._open_file(name, project, self._desk.folder)
        finally:
            self._upload.reset()


async def save_in(folder: Folder, encoded: Encoded, name: str, what: str, *, is_own: bool = False) -> str | None:
    """Save a file after a person has agreed, where one would be replaced.

    Args:
        folder: The folder.
        encoded: What the file holds, and what has to be beside it.
        name: Name of the file.
        what: What messages call it.
        is_own: Whether it is the file that the person edits: if that is as it was, there is no question.

    Returns:
        The full name; None if the person does not agree.
    """
    question = "" if is_own and folder.is_known(folder.full_name(name)) else folder.question(name)
    if question and not await agrees(question):
        return None
    may_replace, beside = is_own or bool(question), encoded[1]
    return await asyncio.to_thread(folder.save, encoded[0], name, what, may_replace=may_replace, beside=beside)
