"""What a notebook shows, in a real kernel: progress in place, results as HTML, figures once, and Ctrl-C."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gaident as ga

manager = pytest.importorskip("jupyter_client.manager", reason="no Jupyter: pip install ipykernel")
pytest.importorskip("ipykernel", reason="no Jupyter kernel: pip install ipykernel")

PREPARED = """\
import gaident as ga
from gaident.cli import demonstration as demo
from gaident.show import progress_bar
progress_bar._QUIET = 0.0
rec, ctl = demo.two_mass_record(0), demo.CONTROLLER
"""


class Kernel:
    """A kernel of Jupyter's, as a notebook talks to it."""

    def __init__(self, folder: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": str(Path(ga.__file__).parents[1]), "IPYTHONDIR": str(folder)}
        self.manager, self.client = manager.start_new_kernel(kernel_name="python3", env=environment)

    def begin(self, cell: str) -> str:
        return str(self.client.execute(cell))

    def messages(self, asked: str) -> list[tuple[str, dict[str, Any]]]:
        """(type, content) of what a cell shows, until it is done."""
        found: list[tuple[str, dict[str, Any]]] = []
        while True:
            message = self.client.get_iopub_msg(timeout=60)
            if message["parent_header"].get("msg_id") == asked:
                kind, content = message["msg_type"], message["content"]
                if kind == "status" and content["execution_state"] == "idle":
                    return found
                if kind not in ("status", "execute_input"):
                    found.append((kind, content))

    def run(self, cell: str) -> list[tuple[str, dict[str, Any]]]:
        return self.messages(self.begin(cell))

    def close(self) -> None:
        self.client.stop_channels()
        self.manager.shutdown_kernel(now=True)


@pytest.fixture(scope="module")
def kernel(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Kernel]:
    started = Kernel(tmp_path_factory.mktemp("ipython"))
    assert started.run(PREPARED) == []
    yield started
    started.close()


@pytest.mark.long
def test_a_notebook_shows_progress_results_and_figures(kernel: Kernel) -> None:
    shown = kernel.run("with ga.progress() as shown:\n    idn = ga.identify(rec, ctl, trials=1000, progress=shown)")  # some 2 s
    (first, opened), *updates = shown
    assert first == "display_data" and {kind for kind, _ in updates} == {"update_display_data"}
    assert len({content["transient"]["display_id"] for _, content in shown}) == 1  # in place
    assert "<progress" in updates[0][1]["data"]["text/html"] and "generation" in updates[0][1]["data"]["text/plain"]
    assert opened["data"]["text/html"] == updates[-1][1]["data"]["text/html"] == "" == updates[-1][1]["data"]["text/plain"]

    for cell, part in (("rec", "<svg"), ("idn", "<table")):
        ((kind, content),) = kernel.run(cell)
        assert kind == "execute_result" and part in content["data"]["text/html"]
    ((kind, content),) = kernel.run("idn.plot_poles()")  # once, and without %matplotlib or pyplot
    assert kind == "execute_result" and content["data"]["image/png"].startswith("iVBOR")
    assert kernel.run("drawn = idn.plot_poles()") == []


def test_interrupting_the_kernel_ends_an_identification_and_nothing_else(kernel: Kernel) -> None:
    asked = kernel.begin("with ga.progress() as shown:\n    ga.identify(rec, ctl, trials=100000, progress=shown)")
    while kernel.client.get_iopub_msg(timeout=60)["msg_type"] != "update_display_data":
        pass  # until it is under way
    kernel.manager.interrupt_kernel()
    *_, last, (kind, content) = kernel.messages(asked)
    assert last[1]["data"]["text/html"] == ""
    assert kind == "error" and content["ename"] == "KeyboardInterrupt"
    ((kind, content),) = kernel.run("6 * 7")
    assert kind == "execute_result" and content["data"]["text/plain"] == "42"
