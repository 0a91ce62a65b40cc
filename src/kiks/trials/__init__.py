"""Programs are tried in cases, each run judged by the goal of its project, on all cores."""
