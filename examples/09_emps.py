"""A measured axis: the ball screw of the EMPS benchmark (Janot, Gautier and Brunot 2019), open loop, in m, m/s and N.

Needs the folder of recorded data that the variable GAIDENT_DATA names (emps/DATA_EMPS.mat); without it there is nothing to do.
With --diagnose it goes on to what the linear model lacks, which takes ten seconds for its 24 841 samples.
"""

import os
import sys
from pathlib import Path

import gaident as ga

log = Path(os.environ.get("GAIDENT_DATA", ".")) / "emps" / "DATA_EMPS.mat"
if not log.is_file():
    print(f"no recorded data: set GAIDENT_DATA to a folder that holds emps/{log.name}")
    sys.exit()

# The log has the position and the voltage of the current loop; 35.15 N/V is the authors' drive gain.
rec = ga.read(
    log,
    columns={"torque": "vir", "position": "qm", "time": "t"},
    units={"torque": 35.15065188248547},
    velocity_cutoff_hz=100.0,
    name="EMPS",
)
idn = ga.identify(rec)
print(idn.summary(axis="linear"))  # falsified: the mass is not to be trusted

if "--diagnose" in sys.argv:
    dia = ga.diagnose(rec, identification=idn)
    print(dia.summary(axis="linear"))  # friction whose viscous part depends on the direction
