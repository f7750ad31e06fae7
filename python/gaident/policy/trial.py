"""Another policy in the place of POLICY, for one process: how `bench/policy.py` measures what a row decides. Internal.

No user's code calls this: a diagnosis is always made by the one policy, and a result that was made by another says nothing of it.
"""

from __future__ import annotations

import sys

from gaident.policy import table

__all__ = ["decide_by"]


def decide_by(policy: table.Policy) -> None:
    """Let this process decide by another policy. Modules take POLICY when they are imported: call it before.

    Raises
    ------
    RuntimeError
        A module of gaident has taken POLICY already, and would go on deciding by it.
    """
    # A module may have a POLICY of its own that is another thing, so identity counts.
    taken = [name for name, module in sys.modules.items() if getattr(module, "__dict__", {}).get("POLICY") is table.POLICY]
    others = sorted(name for name in taken if name != table.__name__)
    if others:
        raise RuntimeError(
            f"{', '.join(others)} has taken the policy already: another one is put in place in a fresh process, before any other "
            "import of gaident"
        )
    table.POLICY = policy
