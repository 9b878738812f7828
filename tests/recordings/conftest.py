# SPDX-License-Identifier: Apache-2.0
import pytest


@pytest.fixture
def file(tmp_path):
    """Write text or bytes to a file and give its path."""

    def written(content, name="run.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return written
