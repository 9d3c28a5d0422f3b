"""Job arrays end to end on a real SLURM: parts, one lost, merged, and the same bits as one run.

    python campaigns/slurm_array.py            # on a cluster; the folder must be seen by its nodes
    python campaigns/slurm_array.py --start    # starts a private SLURM of one node first

Nothing is installed. `--start` needs munged, slurmctld and slurmd on the PATH and root;
all that it makes lies in a temporary folder, and its daemons end with this script.
"""

from __future__ import annotations

import argparse
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import small

import stiction as st

PARTS, LOST = 6, 3
CONFIG = """
ClusterName=campaign
SlurmctldHost={host}
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={top}/munge.socket
StateSaveLocation={top}/state
SlurmdSpoolDir={top}/spool
SlurmctldPidFile={top}/slurmctld.pid
SlurmdPidFile={top}/slurmd.pid
SlurmctldLogFile={top}/slurmctld.log
SlurmdLogFile={top}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName={host} CPUs={cores} State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES State=UP
"""


@contextmanager
def private_slurm() -> Iterator[None]:
    """A SLURM of this machine alone, until the end."""
    lacking = [name for name in ("munged", "slurmctld", "slurmd") if shutil.which(name) is None]
    if lacking or os.geteuid() != 0:
        raise SystemExit(f"--start: needs root and {', '.join(lacking) or 'nothing else'}")
    with tempfile.TemporaryDirectory() as name:
        top = Path(name)
        os.chmod(top, 0o755)
        for folder in ("state", "spool"):
            (top / folder).mkdir()
        key = top / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        host = socket.gethostname().split(".")[0]
        conf = top / "slurm.conf"
        conf.write_text(CONFIG.format(host=host, top=top, cores=os.cpu_count()))
        os.environ["SLURM_CONF"] = str(conf)
        daemons = [
            subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            for command in (
                ["munged", "--foreground", "--force", f"--key-file={key}",
                 f"--socket={top}/munge.socket", f"--pid-file={top}/munged.pid",
                 f"--log-file={top}/munged.log", f"--seed-file={top}/munged.seed"],
                ["slurmctld", "-D", "-f", str(conf)],
                ["slurmd", "-D", "-f", str(conf)],
            )
            if not time.sleep(1.0)
        ]  # fmt: skip
        try:
            for _ in range(30):
                found = subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True)
                if found.stdout.strip() == "idle":
                    break
                time.sleep(1.0)
            else:
                logs = "".join(path.read_text()[-2000:] for path in top.glob("slurm*.log"))
                raise SystemExit(f"SLURM did not start: {found.stdout}{found.stderr}\n{logs}")
            yield
        finally:
            for daemon in reversed(daemons):
                daemon.terminate()
                daemon.wait(20)


def submit(folder: Path, array: str) -> None:
    """Submit parts as a job array, and wait for it."""
    script = folder / "job.sh"
    script.write_text(
        f"#!/bin/sh\n{sys.executable} -m stiction run study.toml --out run"
        f" --part $SLURM_ARRAY_TASK_ID/{PARTS} --workers 1\n"
    )
    command = ["sbatch", "--wait", f"--array={array}", "--cpus-per-task=1", "job.sh"]
    subprocess.run(command, cwd=folder, check=True)


def merged(folder: Path) -> tuple[int, str]:
    """Exit code and errors of the merge."""
    command = [sys.executable, "-m", "stiction", "merge", "run"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    return done.returncode, done.stderr


def campaign() -> None:
    """Submit all parts but one, merge, submit that one, merge again."""
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as name:
        folder = Path(name)
        study = small.study()
        study.to_toml(folder / "study.toml")
        submit(folder, ",".join(str(k) for k in range(1, PARTS + 1) if k != LOST))
        code, said = merged(folder)
        assert code == 1, said
        assert f"1 of {PARTS} parts are not there ({LOST})" in said, said
        submit(folder, str(LOST))
        code, said = merged(folder)
        assert code == 0, said
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            reference = study.run(workers=1, progress=False)
            found = st.open_run(folder / "run").dataset()
        assert found.identical(reference)
        print(f"{PARTS} parts in SLURM's job arrays, one lost and repeated: the bits of one run")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--start", action="store_true", help="start a private SLURM first")
    asked = parser.parse_args()
    if not asked.start and shutil.which("sbatch") is None:
        raise SystemExit("there is no sbatch here; on a machine with SLURM's programs use --start")
    with private_slurm() if asked.start else nullcontext():
        campaign()
