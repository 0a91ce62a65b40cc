"""The kinds of controllers that come with KiKS: names in recipes, in `kiks.controllers` and for `--controller`."""

from __future__ import annotations

import enum


class ControllerKind(enum.StrEnum):
    """The controllers that come with KiKS."""

    LINEAR = "linear"
    MLP = "mlp"
    ELMAN = "elman"
    CTRNN = "ctrnn"
    GRU = "gru"
    PLASTIC = "plastic"
    POLICY = "policy"
