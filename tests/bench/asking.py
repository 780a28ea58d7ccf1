"""asking.py - requests to a station as a client writes them, and what one takes."""

import json
import os
import shutil
import time


def fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder, 0o700)


def line(number, method, **params):
    request = {"jsonrpc": "2.0", "id": number, "method": method, "params": params}
    return json.dumps(request).encode()


def asked_us(client, request):
    """From the request's first byte to the last of its answer."""
    begun = time.perf_counter_ns()
    client.send_line(request)
    answer = client.next_line()
    took = (time.perf_counter_ns() - begun) / 1e3
    if b'"result"' not in answer[:64]:
        raise AssertionError(answer)
    return took
