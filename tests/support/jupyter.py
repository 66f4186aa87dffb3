"""JupyterLab with a token, and pages in Chromium that show its notebooks."""

from __future__ import annotations

import importlib.util
import json
import secrets
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from support.browser import Browser, Page
from support.served import page_of
from support.windows import PATIENCE, environment, until


class Jupyter(NamedTuple):
    """A server of a folder, with its address and token."""

    folder: Path
    address: str
    token: str

    def ask(self, method: str, path: str) -> Any:
        """JSON that the server answers."""
        told = {"Authorization": f"token {self.token}"}
        request = urllib.request.Request(f"{self.address}/api/{path}", method=method, headers=told)
        with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
            return json.loads(answer.read() or "null")

    def opened(self, browser: Browser, name: str) -> Page:
        """A page of a notebook, in which nothing that was open before is open."""
        url = f"{self.address}/lab/tree/{name}?token={self.token}&reset"
        loads = "globalThis.jupyterapp !== undefined && document.querySelector('.jp-Notebook .cm-content') !== null"
        return page_of(browser, self.folder, url, 900, 700, loads)

    def wait_for_kernel(self) -> None:
        """Wait for a kernel that a page is connected to."""
        until(lambda: [each["kernel"]["execution_state"] for each in self._kernels()] == ["idle"])

    def _kernels(self) -> list[Any]:
        return [each for each in self.ask("GET", "sessions") if each["kernel"]["connections"]]

    def without_kernels(self) -> None:
        for each in self.ask("GET", "sessions"):
            self.ask("DELETE", f"sessions/{each['id']}")


@contextmanager
def jupyter(folder: Path) -> Iterator[Jupyter]:
    """A server at a free port, ended at the end; nothing of the user's own Jupyter is read."""
    if importlib.util.find_spec("jupyterlab") is None:
        pytest.skip("JupyterLab is not installed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    told = environment(None, folder) | {"IPYTHONDIR": str(folder / "ipython"), "JUPYTER_NO_CONFIG": "1"}
    told |= {f"JUPYTER_{name}_DIR": str(folder / "jupyter" / name) for name in ("CONFIG", "DATA", "RUNTIME")}
    token = secrets.token_hex(16)
    words = [
        *("--no-browser", "--allow-root", f"--port={port}", "--ServerApp.port_retries=0"),
        *(f"--ServerApp.root_dir={folder}", f"--IdentityProvider.token={token}"),
        *("--LabApp.news_url=None", "--LabApp.extension_manager=readonly", "--LabApp.expose_app_in_browser=True"),
        "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate",
    ]
    line = [sys.executable, "-m", "jupyterlab", *words]
    with (folder / "log").open("w") as log:
        process = subprocess.Popen(line, cwd=folder, env=told, stdout=log, stderr=subprocess.STDOUT)
    server = Jupyter(folder, f"http://127.0.0.1:{port}", token)

    def answers() -> bool:
        assert process.poll() is None, (folder / "log").read_text()
        try:
            return bool(server.ask("GET", "status"))
        except urllib.error.URLError:
            return False

    try:
        until(answers)
        yield server
    finally:
        process.terminate()
        process.wait(30)


def notebook(*cells: str) -> str:
    """A file of cells with code."""
    told = [
        {
            "cell_type": "code",
            "id": f"c{number}",
            "execution_count": None,
            "metadata": {},
            "outputs": [],
            "source": each,
        }
        for number, each in enumerate(cells)
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return json.dumps({"cells": told, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5})


def command(page: Page, name: str) -> None:
    """Begin what an entry of JupyterLab's menus does."""
    page.tell(f"void jupyterapp.commands.execute({json.dumps(name)})")


def windows_of(server: Jupyter) -> list[int]:
    """Processes of windows that were started below the server's folder."""
    found = []
    for each in Path("/proc").glob("[0-9]*"):
        try:
            is_window = b"window.remote" in (each / "cmdline").read_bytes()
            if is_window and (each / "cwd").resolve() == server.folder:
                found.append(int(each.name))
        except OSError:
            continue
    return found
