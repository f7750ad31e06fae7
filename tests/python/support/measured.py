"""Measured records that several tests read."""

from __future__ import annotations

from pathlib import Path

import pytest

import gaident as ga

__all__ = ["EMPS_GAIN", "FILES", "emps_record", "folder"]

EMPS_GAIN = 35.15065188248547  # N/V
FILES = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")


def folder(data_dir: Path, name: str) -> Path:
    path = data_dir / name
    if not path.is_dir():
        pytest.skip(f"no recorded data: {path} does not exist")
    return path


def emps_record(path: Path) -> ga.Record:
    """Force [N] and position [m] of a ball-screw axis; the velocity is the plain difference of the encoder."""
    columns = {"torque": "vir", "position": "qm", "time": "t"}
    return ga.read(path, columns, {"torque": EMPS_GAIN}, name=path.name)
