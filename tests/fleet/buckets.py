"""Runs `host batch` on a bucket of a real S3 server on this machine (moto), and compares the results with those of a folder.

    python3 buckets.py HOST VIRTUAL_BENCH     HOST is built with the feature `buckets`; needs moto[server] and boto3

The server checks signatures and rights. Nothing leaves this machine.
"""

import json
import os
import random
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import boto3
from botocore.exceptions import ClientError

HOST, BENCH = (os.path.abspath(p) for p in sys.argv[1:3])
MUSCLES = 6
KILLS = 4
BUCKET = "pam-bench"


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def server(endpoint: str, port: int, log) -> subprocess.Popen:
    """The server, once it answers."""
    command = [sys.executable, "-c", "from moto.server import main; main()", "-H", "127.0.0.1", "-p", str(port)]
    process = subprocess.Popen(command, stdout=log, stderr=log)
    for _ in range(600):
        try:
            urllib.request.urlopen(f"{endpoint}/moto-api/", timeout=5).close()
            return process
        except OSError:
            assert process.poll() is None, "the S3 server ended"
            time.sleep(0.1)
    raise SystemExit("the S3 server does not answer")


def client(endpoint: str, key: str, secret: str, service: str = "s3"):
    return boto3.client(
        service, endpoint_url=endpoint, region_name="us-east-1", aws_access_key_id=key, aws_secret_access_key=secret
    )


def account(endpoint: str) -> tuple[str, str]:
    """An account that may use the bucket; from now on the server refuses all others."""
    iam = client(endpoint, "setup", "setup", "iam")
    iam.create_user(UserName="bench")
    policy = {"Version": "2012-10-17", "Statement": [{"Effect": "Allow", "Action": "s3:*", "Resource": "*"}]}
    iam.put_user_policy(UserName="bench", PolicyName="bucket", PolicyDocument=json.dumps(policy))
    made = iam.create_access_key(UserName="bench")["AccessKey"]
    plain = {"Content-Type": "text/plain"}
    urllib.request.urlopen(urllib.request.Request(f"{endpoint}/moto-api/reset-auth", data=b"0", headers=plain)).close()
    return made["AccessKeyId"], made["SecretAccessKey"]


def fleet() -> None:
    """Recordings of some muscles and their manifest in the current folder."""
    rows = ["muscle,description,files,batch"]
    for i in range(MUSCLES):
        subprocess.run([BENCH, "record", "--muscle", "mini", "--protocol", "thesis", "--seed", str(i + 1), "--sample-hz", "2", "-o", f"m{i}"],
                       stdout=subprocess.DEVNULL, check=True)  # fmt: skip
        rows.append(f"mini {i},m{i}/muscle.toml,m{i}/*Pa.csv,B{i % 2}")
    rows.append("lost,m0/muscle.toml,m0/none.csv,B0")
    Path("fleet.csv").write_text("\n".join(rows) + "\n")


def batch(environment: dict, manifest: str, output: str, *options: str) -> subprocess.CompletedProcess:
    command = [HOST, "batch", manifest, "-o", output, "--only", "fit", "--jobs", "2", "--json", *options]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)


def objects(s3, prefix: str) -> dict[str, bytes]:
    pages = s3.get_paginator("list_objects_v2").paginate(Bucket=BUCKET, Prefix=prefix + "/")
    keys = [o["Key"] for page in pages for o in page.get("Contents", [])]
    return {k.removeprefix(prefix + "/"): s3.get_object(Bucket=BUCKET, Key=k)["Body"].read() for k in keys}


def files(folder: str) -> dict[str, bytes]:
    root = Path(folder)
    found = {p.relative_to(root).as_posix(): p.read_bytes() for p in root.rglob("*") if p.is_file()}
    # The place of unfinished results, which only a folder has.
    return {name: data for name, data in found.items() if not name.startswith(".partial")}


def same(found: dict[str, bytes], wanted: dict[str, bytes]) -> None:
    """Equal names with equal bytes."""
    apart = sorted(name for name in found.keys() | wanted.keys() if found.get(name) != wanted.get(name))
    # Its failure says whether a file or an object is missing.
    apart = [name for name in apart if not name.startswith("muscle=lost/") or {name} - found.keys()]
    assert not apart, f"{len(apart)} of {len(wanted)} files differ or are missing: {apart[:12]}"


def refused(done: subprocess.CompletedProcess, *words: str) -> None:
    """The call ends with status 1 and an error that contains these words, regardless of where its lines break."""
    said = " ".join(done.stderr.replace("│", " ").split())
    assert done.returncode == 1, (done.returncode, said)
    assert "panicked" not in said, said
    for word in words:
        assert word in said, (word, said)


def killed_and_continued(environment: dict, s3) -> None:
    """Killed at random moments and run again, a batch from a bucket into a bucket ends with the bytes of a folder."""
    start = time.perf_counter()
    whole = batch(environment, "fleet.csv", "whole")
    seconds = time.perf_counter() - start
    assert whole.returncode == 0, whole.stderr
    source, target = f"s3://{BUCKET}/fleet.csv", f"s3://{BUCKET}/results"
    rng = random.Random(7)
    kills = 0
    for _ in range(20 * KILLS):
        if kills == KILLS:
            break
        process = subprocess.Popen([HOST, "batch", source, "-o", target, "--only", "fit", "--jobs", "1", "--quiet"],
                                   env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # fmt: skip
        try:
            process.wait(timeout=seconds * rng.uniform(0.2, 1.5))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            kills += 1
            continue
        # Complete: the next one begins with an empty place.
        same(objects(s3, "results"), files("whole"))
        for key in objects(s3, "results"):
            s3.delete_object(Bucket=BUCKET, Key=f"results/{key}")
    assert kills == KILLS, kills
    before = sum(name.endswith("/fits.parquet") for name in objects(s3, "results"))
    done = batch(environment, source, target)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert (said["reused"], said["computed"], said["failed"]) == (before, MUSCLES + 1 - before, 1), (before, said)
    same(objects(s3, "results"), files("whole"))
    again = json.loads(batch(environment, source, target).stdout)
    assert (again["reused"], again["computed"]) == (MUSCLES + 1, 0), again
    # The other two ways: a folder by its address, and a manifest of this machine that names objects.
    here = Path.cwd()
    assert batch(environment, f"file://{here}/fleet.csv", f"file://{here}/by-address").returncode == 0
    same(files("by-address"), files("whole"))
    rows = (f"{name},s3://{BUCKET}/m1/muscle.toml,s3://{BUCKET}/m1/{files}" for name, files in [("mixed", "*Pa.csv"), ("lost", "none.csv")])
    Path("mixed.csv").write_text("\n".join(["muscle,description,files", *rows]) + "\n")
    mixed = json.loads(batch(environment, "mixed.csv", "mixed").stdout)
    assert (mixed["computed"], mixed["failed"]) == (2, 1), mixed
    (lost,) = mixed["failures"]
    assert (lost["muscle"], lost["code"]) == ("lost", "file::unreadable") and "no such object" in lost["cause"], lost
    assert "none.csv" in lost["place"] and "s3://BUCKET/KEY" in lost["remedy"], lost


def errors(environment: dict, endpoint: str) -> None:
    """What is wrong, and what to do."""
    source, target = f"s3://{BUCKET}/fleet.csv", f"s3://{BUCKET}/other"
    refused(batch(environment, "s3://nowhere/fleet.csv", target), "there is no bucket s3://nowhere", "create it")
    refused(batch(environment, source, "s3://nowhere/results"), "there is no bucket s3://nowhere", "create it")
    refused(batch(environment, f"s3://{BUCKET}/none.csv", target), "the bucket has no such object", "none.csv")
    wrong = {"AWS_SECRET_ACCESS_KEY": "wrong"}, {"AWS_ACCESS_KEY_ID": "AKIAWRONG"}
    for change in wrong:
        refused(batch(environment | change, source, target), "refuses the credentials", "AWS_SECRET_ACCESS_KEY")
        refused(batch(environment | change, "fleet.csv", target), "refuses the credentials", "AWS_SECRET_ACCESS_KEY")
    closed = {"AWS_ENDPOINT": f"http://127.0.0.1:{free_port()}"}
    refused(batch(environment | closed, source, target), "cannot be used", "AWS_ENDPOINT")
    plain = {k: v for k, v in environment.items() if k != "AWS_ALLOW_HTTP"}
    refused(batch(plain, source, target), "not encrypted", "AWS_ALLOW_HTTP")
    shown = subprocess.run([HOST, "fleet", target], env=environment, capture_output=True, text=True)
    assert shown.returncode == 2 and "copy the results" in shown.stderr, shown.stderr


def main() -> None:
    port = free_port()
    endpoint = f"http://127.0.0.1:{port}"
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        fleet()
        with open("server.log", "w") as log:
            process = server(endpoint, port, log)
        try:
            s3 = client(endpoint, "setup", "setup")
            s3.create_bucket(Bucket=BUCKET)
            for path in [Path("fleet.csv"), *Path().glob("m*/*")]:
                s3.upload_file(str(path), BUCKET, path.as_posix())
            key, secret = account(endpoint)
            try:
                client(endpoint, "AKIAWRONG", "x").list_objects_v2(Bucket=BUCKET)
                raise SystemExit("the server accepts everyone: the test would prove nothing")
            except ClientError:
                pass
            environment = {k: v for k, v in os.environ.items() if not k.startswith("AWS_")}
            environment |= {"AWS_ACCESS_KEY_ID": key, "AWS_SECRET_ACCESS_KEY": secret, "AWS_REGION": "us-east-1",
                            "AWS_ENDPOINT": endpoint, "AWS_ALLOW_HTTP": "true", "NO_COLOR": "1"}  # fmt: skip
            killed_and_continued(environment, client(endpoint, key, secret))
            errors(environment, endpoint)
        finally:
            process.terminate()
            process.wait()
    print("buckets: killed and continued, errors: 2 passed, 0 failed")


if __name__ == "__main__":
    main()
