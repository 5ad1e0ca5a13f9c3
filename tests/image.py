"""Starts what the image is made of, without a container engine: the last stage of deploy/Dockerfile is carried out in a folder, and the program is
run in that as its root, as its user, with nothing else of this machine. So a library, a user or a list of certificates that is missing shows.

    tests/image.py BINARY [MOTO_SERVER]

What this cannot show: whether the stages before build, and what else is in the base image. Of that only the loader and the C library are taken,
from this machine; a program that needs another library fails here.
"""

import os
import pathlib
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCKERFILE = ROOT / "deploy" / "Dockerfile"
# What programs in Rust need of the system; debian:bookworm-slim has it.
IN_THE_BASE = re.compile(r"^(libc\.so\.6|libm\.so\.6|libgcc_s\.so\.1|libdl\.so\.2|libpthread\.so\.0|librt\.so\.1|ld-linux.*|linux-vdso.*)$")
PATIENCE = 60


def skip(reason):
    print(f"skipped the image: {reason}")
    if log := os.environ.get("GABLE_SKIP_LOG"):
        with open(log, "a") as file:
            file.write(f"skipped the image: {reason}\n")
    sys.exit(0)


def last_stage():
    """The instructions of the last stage: name and argument."""
    text = re.sub(r"^\s*#.*\n", "", DOCKERFILE.read_text(), flags=re.M).replace("\\\n", " ")
    lines = [line.split(None, 1) for line in text.splitlines() if line.strip()]
    start = max(at for at, line in enumerate(lines) if line[0] == "FROM")
    return [(name, argument.strip()) for name, argument in lines[start:]]


def libraries(program):
    """The libraries that a program is linked with: name and place."""
    told = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    found = []
    for line in told.splitlines():
        match = re.match(r"\s*(\S+)(?: => (\S+))? \(0x", line)
        if match and not match.group(1).startswith("linux-vdso"):
            place = match.group(2) or match.group(1)
            found.append((os.path.basename(match.group(1)), place))
    return found


def copy(source, root, target):
    place = root / target.lstrip("/")
    place.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source, place, follow_symlinks=True)


def run_line(command, root, users):
    """Does what a RUN of the last stage does; only what is written there today is known."""
    for part in command.split("&&"):
        words = shlex.split(part)
        options = dict(word[2:].split("=", 1) if "=" in word else (word[2:], "") for word in words if word.startswith("--"))
        if words[0] == "useradd" and words[1] == "--uid" and "user-group" in options and "no-create-home" in options:
            users[words[-1]] = int(words[2])
        elif words[0] == "install" and "directory" in options:
            place = root / words[-1].lstrip("/")
            place.mkdir(parents=True)
            os.chown(place, users[options["owner"]], users[options["group"]])
        else:
            sys.exit(f"WRONG   deploy/Dockerfile: tests/image.py does not know how to do {part.strip()!r}: teach it")


def build(root, binary, without=()):
    """Carries the last stage out; gives the user and the command."""
    users, user, command = {}, None, []
    for name, place in libraries(binary):
        if not IN_THE_BASE.match(name):
            sys.exit(f"WRONG   the program needs {name}, which the base image has not")
        copy(place, root, place if place.startswith("/lib") else f"/lib/{name}")
    for folder in ("proc", "dev", "tmp", "etc"):
        (root / folder).mkdir(exist_ok=True)
    (root / "tmp").chmod(0o1777)
    for instruction, argument in last_stage():
        if instruction == "FROM":
            if not argument.startswith("debian:"):
                sys.exit(f"WRONG   deploy/Dockerfile: the last stage is from {argument}: teach tests/image.py what that has")
        elif instruction == "RUN":
            run_line(argument, root, users)
        elif instruction == "COPY":
            source, target = argument.split()[-2:]
            if target in without:
                continue
            copy(binary if source.endswith("/gable") else source, root, target)
        elif instruction == "USER":
            user = argument
        elif instruction == "ENTRYPOINT":
            command = re.findall(r'"([^"]*)"', argument)
        elif instruction not in ("VOLUME", "CMD"):
            sys.exit(f"WRONG   deploy/Dockerfile: tests/image.py does not know {instruction}: teach it")
    lines = ["root:x:0:0:root:/root:/bin/sh"] + [f"{name}:x:{uid}:{uid}::/home/{name}:/bin/sh" for name, uid in users.items()]
    (root / "etc" / "passwd").write_text("\n".join(lines) + "\n")
    (root / "etc" / "group").write_text("root:x:0:\n" + "".join(f"{name}:x:{uid}:\n" for name, uid in users.items()))
    return user, command


def start(root, user, command, arguments, variables):
    """Starts the program with the folder as its root, in a space of mounts of its own."""
    # As engines do: /proc and /dev are there, and the environment is the image's.
    script = 'mount -t proc proc "$0/proc" && mount --rbind /dev "$0/dev" && exec chroot --userspec="$1" "$0" "${@:2}"'
    inside = [f"/usr/local/bin/{command[0]}", *command[1:], *arguments]
    return subprocess.Popen(
        ["unshare", "--mount", "bash", "-c", script, str(root), user, *inside],
        env={"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def free_port():
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        return bound.getsockname()[1]


def status(url, data=None, method="GET"):
    try:
        with urllib.request.urlopen(urllib.request.Request(url, data=data, method=method), timeout=10) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return 0


def wait_for(url):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = status(url)
        if found:
            return found
        time.sleep(0.2)
    sys.exit(f"WRONG   {url} does not answer")


def ended(process, what, code=0):
    try:
        out, err = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        out, err = process.communicate()
        sys.exit(f"WRONG   {what}: it does not end: {out}{err}")
    if (process.returncode == 0) != (code == 0):
        sys.exit(f"WRONG   {what}: it ended with {process.returncode}: {out}{err}")
    print(f"ok      {what}")
    return out + err


def with_a_store(root, user, command, moto):
    """A coordinator over S3, started and stopped."""
    port = free_port()
    server = subprocess.Popen([moto, "-H", "127.0.0.1", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_for(f"http://127.0.0.1:{port}/")
        if status(f"http://127.0.0.1:{port}/city", b"", "PUT") != 200:
            sys.exit("WRONG   the S3 server of the test makes no bucket")
        variables = {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
            "AWS_ACCESS_KEY_ID": "test",
            "AWS_SECRET_ACCESS_KEY": "test",
            "AWS_REGION": "us-east-1",
            "GABLE_STORE": "s3://city/artefacts",
        }
        serve = ["serve", "--all", "--slots", "1", "--data", "/cities/data", "--source-root", "/cities", "--listen"]
        listen = free_port()
        process = start(root, user, command, [*serve, f"127.0.0.1:{listen}"], variables)
        try:
            ready = wait_for(f"http://127.0.0.1:{listen}/readyz")
            if ready != 200:
                sys.exit(f"WRONG   a coordinator over S3 is not ready: {ready}")
            print("ok      a coordinator over S3 is ready")
        finally:
            process.send_signal(signal.SIGTERM)
        ended(process, "it stops when it is told to")
        # That this check finds what it is for.
        with tempfile.TemporaryDirectory() as folder:
            bare = pathlib.Path(folder)
            bare.chmod(0o755)
            build(bare, sys.argv[1], without=("/etc/ssl/certs/ca-certificates.crt",))
            process = start(bare, user, command, [*serve, "127.0.0.1:0"], variables)
            told = ended(process, "without certificates it ends at once", code=1)
            if "certificate" not in told:
                sys.exit(f"WRONG   without certificates it does not say that they are missing: {told}")
    finally:
        server.kill()
        server.wait()


def main():
    binary = sys.argv[1]
    moto = sys.argv[2] if len(sys.argv) > 2 else None
    if not sys.platform.startswith("linux") or not shutil.which("unshare") or not shutil.which("chroot"):
        skip("it needs Linux with unshare and chroot")
    if os.geteuid() != 0:
        skip("a change of the root folder takes root")
    with tempfile.TemporaryDirectory() as folder:
        if subprocess.run(["unshare", "--mount", "mount", "-t", "proc", "proc", folder], capture_output=True).returncode != 0:
            skip("this machine lets nobody mount")
    if not os.path.exists("/etc/ssl/certs/ca-certificates.crt"):
        skip("this machine has no certificates to copy (package ca-certificates)")
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        root.chmod(0o755)
        user, command = build(root, binary)
        version = ended(start(root, user, command, ["--version"], {}), "the program starts")
        if not version.startswith("gable "):
            sys.exit(f"WRONG   it says {version!r}")
        for words in (["synth", "--case", "hip", "--out", "/cities/town"], ["run", "/cities/town/mesh", "--out", "/cities/made"]):
            ended(start(root, user, command, words, {}), f"gable {words[0]}")
        if moto and os.path.exists(moto):
            with_a_store(root, user, command, moto)
        else:
            print("skipped a coordinator over S3: moto is not installed")


main()
