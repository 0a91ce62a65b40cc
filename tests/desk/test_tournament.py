"""A tournament on the desk: its games are played one after the other, with the table between them."""

from contextlib import closing
from pathlib import Path

import pytest
from tests.cli.test_tournament import DRIVE, MATCH, REFEREE
from tests.desk.visitor import NewPage, Visitor, check_access, expect, leave_picture, open_desk

pytestmark = pytest.mark.slow


def test_games_are_shown_one_after_the_other_with_the_table_between(tmp_path: Path, new_page: NewPage) -> None:
    from kiks.desk.server.hall import Hall
    from kiks.trials.submissions import submissions_in
    from kiks.trials.tournament import Match, in_order, play

    (tmp_path / "race.kiks").write_text(MATCH.replace("seconds = 3.0", "seconds = 5.0"))
    (tmp_path / "referee.py").write_text(REFEREE)
    for name, speed in {"ann": 5, "bob": 9}.items():
        (tmp_path / f"{name}.py").write_text(DRIVE.format(speed))
    match, out = Match.load(tmp_path / "race.kiks"), tmp_path / "out"
    players = submissions_in([tmp_path / "ann.py", tmp_path / "bob.py"], out / "programs")
    now_s = [0.0]
    hall = Hall("race", tuple(each.name for each in in_order(players)), out, clock=lambda: now_s[0])
    play(match, players, out, is_trusted=True, on_played=hall.note)
    hall.end()
    with closing(open_desk(tmp_path, match.project)) as shown:
        shown.desk.hall = hall
        visitor = Visitor(new_page(1366, 768), shown)
        page = visitor.page
        board = visitor.at("board-hall")
        expect(board).to_have_text("Game 1 of 2")
        expect(visitor.at("board-match")).to_be_visible()
        visitor.click("hall", shows={"board-clock": "of 0:05"})
        table = visitor.at("board-table")
        expect(table).to_contain_text("bob")
        expect(board).to_contain_text("Next: bob – ann")
        check_access(page, "the table between games")
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            leave_picture(page, f"tournament-{scheme}")
        # The break lasts until the clock says so.
        assert shown.desk.past is not None
        now_s[0] += 60
        expect(board).to_have_text("Game 2 of 2")
        expect(table).to_be_hidden()
        expect(board).to_contain_text("The end")
        expect(table.locator("tbody tr").first).to_contain_text("bob")
        expect(table.locator("tbody tr").first).to_contain_text("100%")
