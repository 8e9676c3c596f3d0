"""The link to a window of `lightgraph view --link`: it shows what it is given. Needs neither Blender nor numpy.

A message is a header (JSON) and a body (bytes), behind their lengths; each is answered by a header. What they say
stands in the window's own source, `crates/cli/src/view/link/message.rs`.
"""

from __future__ import annotations

import json
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from urllib.parse import urlsplit

VERSION = 1

# Seconds to connect, and for the window to read a scene.
GREETING, PATIENCE = 5, 120

# Bytes of a body, and of an answer, at most.
BODY, ANSWER = 1 << 30, 1 << 22

# Seconds between two looks at whether the window is still there.
LOOK = 0.5

# Seconds that things are left alone before the scene's bounds are found anew.
REST = 0.3


class Refused(Exception):
    """The window did not take a message. What it showed before stays."""


def address(link: str) -> tuple[str, int, str]:
    """Host, port and token of a link.

    Raises `ValueError` for what is none.
    """
    parts = urlsplit(link.strip())
    token = parts.path.strip("/")
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if parts.scheme != "lightgraph" or not host or not port or not token:
        raise ValueError("that is no link: `lightgraph view --link` prints one, lightgraph://127.0.0.1:PORT/TOKEN")
    return host, port, token


class Connection:
    """A connection to a window.

    All of it raises `OSError` when the window is gone and `Refused` when it does not take what is sent.
    """

    def __init__(self, link: str, program: str) -> None:
        host, port, token = address(link)
        self._socket = socket.create_connection((host, port), GREETING)
        try:
            # Messages are small, and their answers waited for.
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._say("hello", {"version": VERSION, "token": token, "program": program})
            self._socket.settimeout(PATIENCE)
        except BaseException:
            self._socket.close()
            raise

    def scene(self, gltf: bytes, name: str, environment: Any = None) -> None:
        """Shows another scene: the bytes of a .glb, and around it radiance (red, green, blue) or a panorama, a float32
        array of the shape (height, 2 × height, 3)."""
        header: dict[str, Any] = {"name": name}
        parts = [gltf]
        if hasattr(environment, "tobytes"):
            height, width, _ = environment.shape
            header["panorama"] = (width, height)
            parts.append(environment.astype("<f4").tobytes())
        elif environment is not None:
            header["radiance"] = tuple(environment)
        self._say("scene", header, *parts)

    def place(self, places: Mapping[str, Sequence[Sequence[float]]]) -> None:
        """Puts nodes of the scene where matrices say: 4 rows of 4 numbers, node to world."""
        matrices = (struct.pack("<16f", *(v for column in zip(*rows) for v in column)) for rows in places.values())
        self._say("place", {"nodes": list(places)}, b"".join(matrices))

    def camera(self, camera: Mapping[str, Any]) -> None:
        """Sees what `lightgraph.Camera(**camera)` does."""
        self._say("camera", dict(camera))

    def is_open(self) -> bool:
        """Whether the window is there. Never waits."""
        try:
            # Unasked, a window says nothing: what can be read is the end.
            return not select.select([self._socket], [], [], 0)[0]
        except (OSError, ValueError):
            return False

    def close(self) -> None:
        self._socket.close()

    def _say(self, word: str, said: Mapping[str, Any], *body: bytes) -> None:
        header = json.dumps({word: said}, allow_nan=False).encode()
        length = sum(map(len, body))
        if length > BODY:
            raise Refused(f"the {word} has {length} bytes: a message may have {BODY}")
        self._socket.sendall(b"".join((struct.pack("<II", len(header), length), header, *body)))
        fault = self._answer().get("fault")
        if fault is not None:
            raise Refused(str(fault))

    def _answer(self) -> dict[str, Any]:
        header, body = struct.unpack("<II", self._read(8))
        if header > ANSWER or body:
            raise OSError("what answers there is no window of lightgraph")
        try:
            found = json.loads(self._read(header))
        except ValueError:
            found = None
        if not isinstance(found, dict):
            raise OSError("what answers there is no window of lightgraph")
        return found

    def _read(self, count: int) -> bytes:
        parts = []
        while count > 0:
            part = self._socket.recv(min(count, 1 << 16))
            if not part:
                raise OSError("the window has closed, or follows another program")
            parts.append(part)
            count -= len(part)
        return b"".join(parts)


class Link:
    """A window that shows the last content given to it, by a thread of its own. `changed` is called from the thread
    when `state` or `error` are other ones."""

    def __init__(self, link: str, program: str, changed: Callable[[], None] | None = None) -> None:
        self.state = "connecting"
        """`"connecting"`, `"connected"` or `"closed"`."""
        self.error = ""
        """Why it is closed, or what the window did not take."""
        self._changed = changed or (lambda: None)
        self._condition = threading.Condition()
        self._wanted: tuple[Any, Mapping[str, Any] | None] | None = None
        # What the window shows, and what its scene was made of before things were placed.
        self._content: Any = None
        self._laid: Any = None
        # What was sent last, and why the window did not take it.
        self._tried: Any = None
        self._fault = ""
        self._camera: Any = None
        self._stopped = False
        self._thread = threading.Thread(target=self._run, args=(link, program), name="lightgraph link", daemon=True)
        self._thread.start()

    def show(self, content: Any, camera: Mapping[str, Any] | None) -> None:
        """Shows this from now on, and returns at once: `content.Content`, and what `lightgraph.Camera` is made with."""
        with self._condition:
            self._wanted = (content, camera)
            self._condition.notify_all()

    def stop(self) -> None:
        """Ends the connection. It is not waited for: a message may be under way."""
        with self._condition:
            self._stopped = True
            self._condition.notify_all()

    def _tell(self, state: str, error: str) -> None:
        if (self.state, self.error) != (state, error):
            self.state, self.error = state, error
            self._changed()

    def _run(self, link: str, program: str) -> None:
        connection = None
        try:
            connection = Connection(link, program)
            self._tell("connected", "")
            while (wanted := self._next(connection)) is not None:
                self._tell("connected", self._follow(connection, *wanted))
            self._tell("closed", "")
        except BaseException as error:
            self._tell("closed", str(error) or type(error).__name__)
        finally:
            if connection is not None:
                connection.close()

    def _next(self, connection: Connection) -> tuple[Any, Any] | None:
        """Waits for what is to be shown; `(None, None)` once what was placed has come to rest. None when stopped."""
        end = time.monotonic() + REST
        with self._condition:
            while not self._stopped:
                wanted, self._wanted = self._wanted, None
                if wanted is not None:
                    return wanted
                left = end - time.monotonic()
                if self._content is not self._laid and left <= 0:
                    return None, None
                self._condition.wait(LOOK if self._content is self._laid else left)
                if not connection.is_open():
                    raise OSError("the window has closed, or follows another program")
        return None

    def _follow(self, connection: Connection, content: Any, camera: Mapping[str, Any] | None) -> str:
        """Sends what is new. What the window did not take, and why."""
        blind = ""
        if camera is not None and camera != self._camera:
            self._camera = camera
            try:
                connection.camera(camera)
            except (Refused, ValueError) as error:
                blind = str(error)
        if content is None:
            self._settle(connection)
        elif content is not self._tried:
            self._tried, self._fault = content, ""
            try:
                self._send(connection, content)
            except (Refused, ValueError, TypeError, OverflowError, MemoryError) as error:
                # The next one goes whole.
                self._content = self._laid = None
                self._fault = str(error) or "there is not enough memory"
        return "\n".join(filter(None, (blind, self._fault)))

    def _send(self, connection: Connection, content: Any) -> None:
        if not content.fits(self._content):
            self._scene(connection, content)
            return
        moved = content.moved(self._content)
        if moved:
            connection.place({name: matrix.tolist() for name, matrix in moved.items()})
        elif self._content is self._laid:
            self._laid = content
        self._content = content

    def _settle(self, connection: Connection) -> None:
        """Where what was placed has left the scene's bounds, the scene goes anew, as from a fresh start."""
        if self._content.bounds() != self._laid.bounds():
            self._scene(connection, self._content)
        self._laid = self._content

    def _scene(self, connection: Connection, content: Any) -> None:
        connection.scene(content.glb(), "Blender", content.environment)
        self._content = self._laid = content
