"""Mishandle KiKS: hostile files, calls, messages, bytes, faults, days on end, crowds. Nothing may kill it or hang it.

Every case is a number: `--only files.robot --case 1234` plays it again, here, with its traceback. The same seed makes
the same cases. Exit code 1: a promise is broken.

    python tools/torture.py --json
    python tools/torture.py --only files --share 0.01
"""

from __future__ import annotations

import argparse
import faulthandler
import importlib
import json
import os
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tools.campaigns.runner import (
    Broken,
    Campaign,
    Figure,
    Result,
    limit_memory,
    play_case,
    rng_of,
    run,
    verdicts,
)

GROUPS = (
    *(
        "files",
        "calls",
        "messages",
        "compiled",
        "names",
        "wire",
        "faults",
        "octave",
        "crowd",
        "users",
        "soak",
        "tests",
        "worlds",
        "pages",
    ),
    "planted",
)
"""Groups of campaigns: modules of `tools.campaigns`."""

PEAK_MAX_MB = 2000
"""Most memory that reading a file of 1 MB may take [MB]."""

GROWTH_MAX_MB = 5
"""Most memory that 24 simulated hours may add [MB]."""


def chosen(only: list[str]) -> Iterator[Campaign]:
    """Yield the campaigns whose name begins with one of some words; if there are none, all that need not be named."""
    for group in GROUPS:
        if only and not any(word.split(".")[0] == group for word in only):
            continue
        for campaign in importlib.import_module(f"tools.campaigns.{group}").campaigns():
            if any(campaign.name == word or campaign.name.startswith(f"{word}.") for word in only) or (
                not only and not campaign.is_named_only
            ):
                yield campaign


def figures(results: list[Result]) -> dict[str, float]:
    """Return the figures that have a bar, and how much was tried in each campaign."""
    counts = verdicts(results)
    found = {
        "torture.deaths": counts["death"],
        "torture.foreign_exceptions": counts["foreign"] + counts["message"],
        "torture.hangs": counts["hang"],
        "torture.files_lost": counts["lost"],
        "torture.peak_mb": round(max((r.peak_mb for r in results if r.name.startswith("files.")), default=0.0), 1),
        "torture.soak_growth_mb": round(max((r.figures.get("growth_mb", 0.0) for r in results), default=0.0), 2),
        "torture.prompt_s": round(max((r.figures.get("prompt_s", 0.0) for r in results), default=0.0), 2),
    }
    return found | {f"torture.tried.{result.name}": result.tried for result in results}


def is_good(found: dict[str, float]) -> bool:
    """Say whether no bar is broken."""
    zeros = ("deaths", "foreign_exceptions", "hangs", "files_lost")
    is_clean = not any(found[f"torture.{name}"] for name in zeros)
    return is_clean and found["torture.peak_mb"] < PEAK_MAX_MB and found["torture.soak_growth_mb"] <= GROWTH_MAX_MB


def row(result: Result) -> str:
    """Return the line of a campaign in the table."""
    counts = verdicts([result])
    cells = [counts[verdict] for verdict in ("death", "foreign", "message", "hang", "lost")]
    words = "".join(f"{cell:>9}" for cell in cells)
    return (
        f"{result.name:<24}{result.tried:>12,}{result.refused:>10,}{words}{result.peak_mb:>9.0f}{result.seconds:>8.0f}"
    )


HEAD = (
    f"{'campaign':<24}{'tried':>12}{'refused':>10}{'deaths':>9}{'foreign':>9}{'messages':>9}{'hangs':>9}{'lost':>9}"
    f"{'peak MB':>9}{'s':>8}"
)


def play_one(campaign: Campaign, case: int, seed: int) -> int:
    """Play one case in this process, so that everything that it says is seen; return the exit code."""
    play = campaign.prepare()
    faulthandler.enable()
    limit_memory(campaign)
    try:
        tried, is_refused = play_case(play, rng_of(seed, campaign.name, case))
    except Broken as broken:
        traceback.print_exception(broken)
        return 1
    except Figure as figure:
        print(figure)
        return 0
    print(f"{campaign.name}, case {case}, seed {seed}: {'refused' if is_refused else 'done'}, {tried} tried")
    return 0


def main() -> int:
    """Run campaigns; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", default=[], help="a group or a campaign; may be given again")
    parser.add_argument("--seed", type=int, default=0, help="the same seed makes the same cases")
    parser.add_argument("--share", type=float, default=1.0, help="which share of the cases is played")
    parser.add_argument("--cases", type=int, help="how many cases of each campaign are played")
    parser.add_argument("--case", type=int, help="play this case alone, in this process")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes at a time")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--list", action="store_true", help="say which campaigns there are")
    options = parser.parse_args()
    campaigns = list(chosen(options.only))
    if not campaigns:
        parser.error(f"--only must name a group of {', '.join(GROUPS)}, or a campaign that --list lists")
    if options.list:
        print("\n".join(f"{campaign.name:<24}{campaign.cases:>12,}" for campaign in campaigns))
        return 0
    if options.case is not None:
        return play_one(campaigns[0], options.case, options.seed)
    results = []
    out = sys.stderr if options.json else sys.stdout
    print(HEAD, file=out, flush=True)
    for campaign in campaigns:
        count = max(round(campaign.cases * options.share), 1) if options.cases is None else options.cases
        result = run(campaign, cases=range(min(count, campaign.cases)), seed=options.seed, jobs=options.jobs)
        results.append(result)
        print(row(result), file=out, flush=True)
        if result.name.startswith("files.") and result.peak_mb > PEAK_MAX_MB / 2:
            print(f"    {result.peak_mb:.0f} MB at --case {result.peak_case}", file=out, flush=True)
        for finding in result.findings:
            print(
                f"    {finding.count} x {finding.verdict}: {finding.where}: {finding.text}; "
                f"first --only {finding.campaign} --seed {options.seed} --case {finding.first}",
                file=out,
                flush=True,
            )
    found = figures(results)
    if options.json:
        print(json.dumps(found, indent=1))
    else:
        print("\n".join(f"{name} = {value:g}" for name, value in found.items() if ".tried." not in name))
    return 0 if is_good(found) else 1


if __name__ == "__main__":
    sys.exit(main())
