# SPDX-License-Identifier: Apache-2.0
"""Who is answered: the studio's own page alone, under its own name, and elsewhere than on loopback with a token alone.

A page of another site must not reach the server: a request whose ``Host`` is not the server's own is refused, which a
name that was pointed at its address would have, and so is one whose ``Origin`` is another, or that a page of another
site makes for something else than to be shown.
"""

import hmac
import ipaddress
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import parse_qs

LOOPBACK = "127.0.0.1"
NAMES = (LOOPBACK, "localhost", "[::1]")
ANOTHER_HOST = "The request names another host than the studio's.\n"
ANOTHER_SITE = "The request comes from the page of another site.\n"
WITHOUT_TOKEN = (
    "This studio opens with the whole address that needleforce studio printed when it began: it has a token.\n"
)


def is_loopback(address: str) -> bool:
    """Whether only this computer reaches an address."""
    return ipaddress.ip_address(address.partition("%")[0]).is_loopback


@dataclass(frozen=True)
class Access:
    """The host and port under which the studio is reached, and the token that it asks for; empty for none."""

    host: str
    port: int
    token: str = ""

    @classmethod
    def opened(cls, host: str, port: int, *, loopback: bool) -> "Access":
        """With a token that cannot be guessed, unless only this computer reaches the server."""
        return cls(host, port, "" if loopback else secrets.token_urlsafe(32))

    @property
    def address(self) -> str:
        """What a browser opens."""
        return f"http://{self._name}:{self.port}/" + (f"?token={self.token}" if self.token else "")

    @property
    def hosts(self) -> set[str]:
        """What a request may name as its host."""
        names = {self._name} if self.token else {*NAMES, self._name}
        return {f"{name}:{self.port}" for name in names} | (names if self.port == 80 else set())

    @property
    def cookie(self) -> str:
        """The name of the cookie: browsers give those of one host to all its ports."""
        return f"needleforce-{self.port}"

    @property
    def _name(self) -> str:
        return f"[{self.host}]" if ":" in self.host else self.host.lower()

    def opens(self, given: str) -> bool:
        """Whether a token is the right one, in a time that does not depend on how much of it is."""
        return hmac.compare_digest(given.encode("utf-8", "replace"), self.token.encode())


class OwnPageOnly:
    """Refuses what does not come from the studio's own page, and puts the headers of safety on every answer."""

    def __init__(self, app: Callable, access: Access, headers: dict[str, str]):
        self.app, self.access, self.headers = app, access, headers
        self.hosts = access.hosts
        self.origins = {f"http://{host}" for host in self.hosts}

    async def __call__(self, scope: dict, receive: Callable, send: Callable) -> None:
        """Answer a request, or pass it on."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if answer := self._instead(scope):
            await answer(scope, receive, send)
            return

        async def send_with_headers(message: dict) -> None:
            if message["type"] == "http.response.start":
                given = {name.lower() for name, _ in message["headers"]}
                own = [(name.encode(), value.encode()) for name, value in self.headers.items()]
                more = [header for header in own if header[0] not in given]
                message = {**message, "headers": [*message["headers"], *more]}
            await send(message)

        await self.app(scope, receive, send_with_headers)

    def _instead(self, scope: dict) -> Callable | None:
        """What is answered instead of the page: a refusal, or the cookie for the token of the first visit."""
        from starlette.responses import PlainTextResponse, RedirectResponse

        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1"), []).append(value.decode("latin-1"))
        if reason := self._refusal(scope["method"], headers):
            return PlainTextResponse(reason, status_code=403, headers=self.headers)
        if not self.access.token:
            return None
        asked = parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        if scope["path"] == "/" and scope["method"] == "GET" and any(map(self.access.opens, asked)):
            first = RedirectResponse("/", status_code=303, headers=self.headers)
            first.set_cookie(self.access.cookie, self.access.token, httponly=True, samesite="strict")
            return first
        if not any(map(self.access.opens, self._tokens(headers))):
            return PlainTextResponse(WITHOUT_TOKEN, status_code=403, headers=self.headers)
        return None

    def _refusal(self, method: str, headers: dict[str, list[str]]) -> str:
        """Why a request is refused, or nothing."""
        hosts = [value.lower() for value in headers.get("host", [])]
        origins = [value.lower() for value in headers.get("origin", [])]
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return ANOTHER_HOST
        if any(origin not in self.origins for origin in origins) or not (origins or method in ("GET", "HEAD")):
            return ANOTHER_SITE
        from_another = not {"cross-site", "same-site"}.isdisjoint(headers.get("sec-fetch-site", []))
        return ANOTHER_SITE if from_another and headers.get("sec-fetch-mode") != ["navigate"] else ""

    def _tokens(self, headers: dict[str, list[str]]) -> list[str]:
        """The tokens of a request: of its cookies, or of a program that asks."""
        parts = [part.partition("=") for each in headers.get("cookie", []) for part in each.split(";")]
        cookies = [value for name, _, value in parts if name.strip() == self.access.cookie]
        bearers = [each.partition(" ") for each in headers.get("authorization", [])]
        return cookies + [value for kind, _, value in bearers if kind.lower() == "bearer"]
