"""Test that the notebook's stop button ends the cell and keeps the kernel."""

import queue
import time

import pytest
from jupyter_client.manager import start_new_kernel

SETUP = """
from chaincor import Scene, collide, sweep
small = Scene(particles=5, tolerance=1e-4, engine="reference")
large = Scene(particles=30000, engine="reference")
before = collide(small).restitution
"""

# The cells take far longer than the test. Workers must load compiled code before they begin.
CELLS = {
    "collide": "print('BEGINS', flush=True); collide(large)",
    "collide a list": "print('BEGINS', flush=True); "
    "collide([large.replace(speed=0.1 * k) for k in range(1, 9)], workers=2)",
    "sweep": "print('BEGINS', flush=True); "
    "sweep(large, speed=[0.1 * k for k in range(1, 9)], workers=2)",
}


@pytest.fixture(scope="module")
def kernel():
    manager, client = start_new_kernel(kernel_name="python3")
    reply = client.execute_interactive(SETUP, timeout=300, output_hook=lambda _: None)
    assert reply["content"]["status"] == "ok"
    yield manager, client
    client.stop_channels()
    manager.shutdown_kernel(now=True)


def stop_in_the_middle(kernel, cell):
    """Run a cell, press stop some time after it prints BEGINS, and return its reply."""
    manager, client = kernel
    client.execute(cell)
    said = ""
    while "BEGINS" not in said:
        message = client.get_iopub_msg(timeout=300)
        said += message["content"].get("text", "") if message["msg_type"] == "stream" else ""
    time.sleep(2.0)
    manager.interrupt_kernel()
    return client.get_shell_msg(timeout=300)["content"]


@pytest.mark.slow
@pytest.mark.parametrize("cell", CELLS)
def test_stop_ends_the_cell_and_the_kernel_goes_on(kernel, cell):
    reply = stop_in_the_middle(kernel, CELLS[cell])
    assert (reply["status"], reply["ename"]) == ("error", "KeyboardInterrupt")
    # The traceback has the lines of the cell and of the called function, with a heading for each.
    assert len(reply["traceback"]) <= 5
    client = kernel[1]
    while True:
        try:
            client.get_iopub_msg(timeout=0.2)
        except queue.Empty:
            break
    reply = client.execute_interactive(
        "assert collide(small).restitution == before", timeout=300, output_hook=lambda _: None
    )
    assert reply["content"]["status"] == "ok"
