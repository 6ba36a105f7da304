# Runs on the host, as `python3 -c`: start the agent that the host keeps, if it is the requested one.
# Arguments: nonce, digest of the agent, number of bytes of it that come first on standard input (0: none).
# No single quote, backslash or exclamation mark may stand here: login shells differ about them.
# A short life: garbage is collected rarely, and the process ends without the work of leaving Python.
import gc, os, sys, zlib
from _frozen_importlib_external import MAGIC_NUMBER
gc.set_threshold(50000)
os.umask(0o022)
nonce, digest, size = sys.argv[1:4]
folder = os.environ.get("SWARM_PREFIX", "") + "/opt/swarm/.agent"
path = folder + "/" + digest + ".zip"
fast = folder + "/" + digest + "-" + MAGIC_NUMBER.hex() + ".zip"
def intact(data):
    import hashlib
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
            return file.read(8) == b"%08x" % zlib.crc32(file.read())
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
ready = compiled()
if ready or kept():
    sys.path.insert(0, fast if ready else path)
    from swarm_onboard.agent.main import serve
    serve(nonce)
    if not ready:
        from swarm_onboard.agent.compiled import write
        write(path, fast)
    sys.stdout.flush()
    os._exit(0)
else:
    print(chr(10) + "@" + nonce, reason)
