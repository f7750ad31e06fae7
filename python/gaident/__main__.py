"""python -m gaident: the command line."""

from __future__ import annotations

import sys

from gaident.cli import main

sys.exit(main())
