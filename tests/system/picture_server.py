"""A network camera: sends JPEG pictures over HTTP, one after the other, to whoever asks."""

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np


class PictureServer:
    """Serves the same picture for ever on a port of the loopback."""

    def __init__(self, picture: np.ndarray, port: int = 0, rate_hz: float = 30.0) -> None:
        data = cv2.imencode(".jpg", picture)[1].tobytes()
        part = b"--next\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(data) + data + b"\r\n"
        self._ended = threading.Event()
        ended = self._ended

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=next")
                self.end_headers()
                try:
                    while not ended.is_set():
                        self.wfile.write(part)
                        time.sleep(1.0 / rate_hz)
                except OSError:
                    pass

            def log_message(self, *_: object) -> None:
                pass

        class Server(ThreadingHTTPServer):
            daemon_threads = True
            allow_reuse_address = True

        self._server = Server(("127.0.0.1", port), Handler)
        self.port = self._server.server_address[1]
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/camera.mjpg"

    def end(self) -> None:
        """Hang up on everybody."""
        self._ended.set()
        self._server.shutdown()
        self._server.server_close()
