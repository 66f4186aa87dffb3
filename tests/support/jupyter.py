"""JupyterLab or Notebook 7, and a page in Chromium that shows a notebook of it."""

from __future__ import annotations

import json
import os
import secrets
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from support.browser import Browser
from support.served import page_of
from support.windows import until
