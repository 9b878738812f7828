# SPDX-License-Identifier: Apache-2.0
"""A protocol run to its end, over as many sessions as it takes: what is there is not done again."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

from ..acquisition.settings import Settings
from ..errors import InputError
from .folder import look
from .lock import alone
from .protocol import Protocol
from .session import CampaignOutcome, Session


def run_protocol(
    protocol: Protocol,
    folder,
    open_sources: Callable,
    settings: Settings,
    *,
    view: Callable | None = None,
    ask: Callable[[str], bool] | None = None,
    say: Callable[[str], None] = print,
    same_site: bool = False,
) -> CampaignOutcome:
    """Record every run of ``protocol`` that is not yet in ``folder``, made if absent.

    ``open_sources()`` gives a force source and an axis, anew for every run. The protocol's words on sensor and bias
    count before those of ``settings``, and the lower force limit. ``ask`` puts a yes-no question to the operator, None
    where nobody is there; ``same_site``, or a yes, lets a run go into the hole of one that was broken off when no spare
    site is left. Ctrl-C ends cleanly, with the needle where it is; the next session withdraws it first.

    Raises InputError for an axis that cannot do what the protocol asks, for a folder of another protocol or in use by
    another session, and for what prevents a run.
    """
    path = _made(folder)
    session = Session(protocol, path, open_sources, _settings(protocol, settings), view, ask, say, same_site)
    with alone(path):
        look(path, protocol)  # another protocol's folder is refused before anything in it is touched
        session.set_aside()
        ended = session.run()
        session.set_aside()
        return session.outcome(ended)


def _made(folder) -> Path:
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("folder", "not made", error.strerror or "", str(path), "Give another one.") from None
    return path


def _settings(protocol: Protocol, settings: Settings) -> Settings:
    return dataclasses.replace(
        settings,
        force_limit=min(protocol.force_limit, settings.force_limit),
        bias_time=protocol.bias_time,
        axial=protocol.axial,
        filter_length=protocol.filter_length,
        duration=None,
    )
