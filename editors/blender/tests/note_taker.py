"""A window that takes notes, for tests of the link with and without Blender."""

import contextlib
import json
import socket
import struct
import threading
import time

TOKEN = "0123456789abcdef"


def until(true, seconds=30):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it does not come about"
        time.sleep(0.01)


class Window:
    """Takes what is sent, and answers `faults` in turn."""

    def __init__(self, answer=None):
        self.messages, self.faults, self._answer = [], [], answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.link = f"lightgraph://127.0.0.1:{self._listener.getsockname()[1]}/{TOKEN}"
        self._stream = None
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        self._stream, _ = self._listener.accept()
        with contextlib.suppress(OSError), self._stream.makefile("rb") as said:
            while len(lengths := said.read(8)) == 8:
                header, body = struct.unpack("<II", lengths)
                ((word, more),) = json.loads(said.read(header)).items()
                self.messages.append((word, more, said.read(body)))
                fault = json.dumps({"fault": self.faults.pop(0) if self.faults else None}).encode()
                self._stream.sendall(self._answer or struct.pack("<II", len(fault), 0) + fault)

    def words(self):
        return [m[0] for m in self.messages]

    def close(self):
        self._stream.shutdown(socket.SHUT_RDWR)
        self._stream.close()
