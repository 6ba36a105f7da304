# Runs on the host, as `python3 -c`: start the agent that the host keeps, if it is the requested one.
# Arguments: nonce, digest of the agent, number of bytes of it that come first on standard input (0: none).
# No single quote, backslash or exclamation mark may stand here: login shells differ about them.
import hashlib, os, sys
from _frozen_importlib_external import MAGIC_NUMBER
nonce, digest, size = sys.argv[1:4]
folder = os.environ.get("SWARM_PREFIX", "") + "/opt/swarm/.agent"
path = folder + "/" + digest + ".zip"
fast = folder + "/" + digest + "-" + MAGIC_NUMBER.hex() + ".zip"
def intact(data):
    return hashlib.sha256(data).hexdigest() == digest
def kept():
    try:
        with open(path, "rb") as file:
            return intact(file.read())
    except OSError:
        return False
def compiled():
    try:
        with open(fast, "rb") as file:
            return file.read(64) == hashlib.sha256(file.read()).hexdigest().encode()
    except OSError:
        return False
def keep(data):
    if intact(data):
        os.makedirs(folder, 0o755, True)
        with open(path + ".new", "wb") as file:
            file.write(data)
        os.replace(path + ".new", path)
reason = "need-agent"
if int(size):
    try:
        keep(sys.stdin.buffer.read(int(size)))
    except OSError as error:
        reason = "cannot-keep-agent %s" % error
if kept():
    ready = compiled()
    sys.path.insert(0, fast if ready else path)
    from swarm_agent.main import serve
    serve(nonce)
    if not ready:
        from swarm_agent.compiled import write
        write(path, fast)
else:
    print(chr(10) + "@" + nonce, reason)
