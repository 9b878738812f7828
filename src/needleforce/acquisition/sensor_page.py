# SPDX-License-Identifier: Apache-2.0
"""The sensor's configuration, from its own web server or from a file."""

import urllib.request
from http.client import HTTPException
from pathlib import Path

from ..errors import InputError
from ..wire.sensor_configuration import LONGEST, PAGE, SensorConfiguration, parse_configuration

_PATIENCE = 3.0  # [s]
_ADVICE = "Name its address or a saved copy with --sensor-page."


def read_configuration(host: str, page: str = "") -> SensorConfiguration:
    """What ``page`` says, a URL or a file; without one, the page of ``host`` on port 80. Raises InputError."""
    place = page or f"http://{host}/{PAGE}"
    read = _fetched if place.startswith(("http://", "https://")) else _from_file
    return parse_configuration(read(place), place)


def _fetched(url: str) -> bytes:
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # a sensor is on the lab's own network
    try:
        with opener.open(url, timeout=_PATIENCE) as answer:
            return answer.read(LONGEST + 1)
    except (OSError, ValueError, HTTPException) as error:
        reason = str(getattr(error, "reason", "") or getattr(error, "strerror", "") or error)
        raise InputError("sensor's configuration", "not read", reason[:120], url, _ADVICE) from None


def _from_file(path: str) -> bytes:
    try:
        with Path(path).open("rb") as file:
            return file.read(LONGEST + 1)
    except OSError as error:
        raise InputError("sensor's configuration", "not read", error.strerror or "", path, _ADVICE) from None
