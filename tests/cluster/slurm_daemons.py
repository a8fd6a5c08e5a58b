"""SLURM itself on this machine: munged, slurmctld and slurmd on loopback, with everything they write in one folder."""

from __future__ import annotations

import contextlib
import os
import pwd
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

NEEDED = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scontrol")
PATIENCE = 60.0
"""Seconds in which everything has to have started; it takes some two."""

CONF = """
ClusterName=tarsus
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={place}/munge/socket
CredType=cred/munge
StateSaveLocation={place}/state
SlurmdSpoolDir={place}/spool
SlurmctldPidFile={place}/slurmctld.pid
SlurmdPidFile={place}/slurmd.pid
SlurmctldLogFile={place}/slurmctld.log
SlurmdLogFile={place}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
MpiDefault=none
ReturnToService=2
JobRequeue=1
KillWait=5
MinJobAge=30
SchedulerParameters=batch_sched_delay=1,sched_interval=5,requeue_setup_env_fail
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=1000 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@contextlib.contextmanager
def slurm(cpus: int = 2) -> Iterator[Path]:
    """A cluster of one node with so many processors; SLURM's commands find it by `SLURM_CONF`, and logs lie there.

    Raises RuntimeError, saying what is missing, where it cannot be had.
    """
    path = f"{os.environ['PATH']}:/usr/sbin:/sbin"
    missing = [name for name in NEEDED if shutil.which(name, path=path) is None]
    if missing:
        raise RuntimeError(
            f"SLURM's {', '.join(missing)} are not installed (Debian: slurmctld slurmd slurm-client munge)"
        )
    place = Path(tempfile.mkdtemp(prefix="tarsus-slurm-"))
    place.chmod(0o755)  # munge wants its socket to be reachable
    (place / "munge").mkdir(mode=0o755)
    (place / "state").mkdir()
    (place / "spool").mkdir()
    key = place / "munge" / "key"
    key.write_bytes(secrets.token_bytes(128))
    key.chmod(0o600)
    words = {
        "host": socket.gethostname().split(".")[0],
        "place": place,
        "user": pwd.getpwuid(os.getuid()).pw_name,
        "cpus": cpus,
        "controller": _free_port(),
        "node": _free_port(),
    }
    (place / "slurm.conf").write_text(CONF.format(**words), encoding="utf-8")
    (place / "cgroup.conf").write_text("CgroupPlugin=autodetect\n", encoding="utf-8")
    before = {name: os.environ.get(name) for name in ("SLURM_CONF", "PATH")}
    os.environ |= {"SLURM_CONF": str(place / "slurm.conf"), "PATH": path}
    daemons: list[subprocess.Popen[bytes]] = []
    try:
        munge = ["munged", "--foreground", "--force", f"--key-file={key}", f"--socket={place}/munge/socket"]
        munge += [f"--{name}-file={place}/munge/{name}" for name in ("pid", "seed", "log")]
        for command in (munge, ["slurmctld", "-D", "-c"], ["slurmd", "-D", "-N", str(words["host"])]):
            with (place / f"{command[0]}.out").open("wb") as said:
                daemons.append(subprocess.Popen(command, stdout=said, stderr=said))
            time.sleep(0.5)
        _wait_for_node(place)
        yield place
    finally:
        subprocess.run(["scancel", "--signal=KILL", "--state=RUNNING"], check=False, capture_output=True, timeout=60)
        for daemon in reversed(daemons):
            daemon.send_signal(signal.SIGTERM)
        for daemon in daemons:
            with contextlib.suppress(subprocess.TimeoutExpired):
                daemon.wait(20)
            daemon.kill()
        for name, text in before.items():
            os.environ.pop(name, None) if text is None else os.environ.update({name: text})
        shutil.rmtree(place, ignore_errors=True)


def _wait_for_node(place: Path) -> None:
    """Until the node is idle."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        done = subprocess.run(["sinfo", "--noheader", "--format=%T"], capture_output=True, text=True, timeout=60)
        if done.stdout.strip() == "idle":
            return
        time.sleep(0.2)
    logs = {
        file.name: file.read_text(errors="replace")[-600:]
        for file in place.rglob("*")
        if file.suffix in (".log", ".out")
    }
    raise RuntimeError(f"SLURM's node did not come up: {done.stdout} {done.stderr} {logs}")
