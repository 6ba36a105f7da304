# Runs on the host, as `python3 -c`: start the agent that the host keeps, if it is the requested one.
# Arguments: nonce, digest of the agent, number of bytes of it that come first on standard input (0: none).
# No single quote, backslash or exclamation mark may stand here: login shells differ about them.
import hashlib, os, sys
nonce, digest, size = sys.argv[1:4]
folder = os.environ.get("SWARM_PREFIX", "") + "/opt/swarm/.agent"
path = folder + "/" + digest + ".zip"
def intact(data):
    return hashlib.sha256(data).hexdigest() == digest
def kept():
    try:
        with open(path, "rb") as file:
            return intact(file.read())
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
    sys.path.insert(0, path)
    from swarm_agent.main import serve
    serve(nonce)
else:
    print(chr(10) + "@" + nonce, reason)
