"""Where things stand in the project."""

from __future__ import annotations

from pathlib import Path

__all__ = ["BENCH", "CORE", "GOLDEN", "PACKAGE", "ROOT", "SAMPLES", "SUPPORT"]

ROOT = Path(__file__).resolve().parents[3]
BENCH = ROOT / "bench"
CORE = ROOT / "csrc" / "gaident"
PACKAGE = ROOT / "python" / "gaident"
SUPPORT = Path(__file__).parent
SAMPLES = SUPPORT / "samples"
GOLDEN = SUPPORT / "golden"
