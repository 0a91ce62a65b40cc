"""The version of KiKS, which files and other computers are compared with."""

__version__ = "3.0.0.dev0"
