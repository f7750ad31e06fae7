"""Where things stand in the project."""

from __future__ import annotations

from pathlib import Path

__all__ = ["BENCH", "CORE", "GOLDEN", "PACKAGE", "ROOT", "SAMPLES"]

ROOT = Path(__file__).resolve().parents[3]
BENCH = ROOT / "bench"
CORE = ROOT / "csrc" / "gaident"
PACKAGE = ROOT / "python" / "gaident"
SAMPLES = Path(__file__).parent / "samples"
GOLDEN = Path(__file__).parent / "golden"
