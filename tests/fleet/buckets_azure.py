"""Runs `host batch` on a container of a real Azure storage server on this machine (Azurite), and compares the results with those of a folder.

    python3 buckets_azure.py HOST VIRTUAL_BENCH     HOST is built with the feature `buckets`; needs npm and azure-storage-blob

The server checks signatures. Nothing leaves this machine.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

from azure.core.exceptions import AzureError
from azure.storage.blob import BlobServiceClient
from buckets import MUSCLES, batch, files, fleet, free_port, refused, same

# The account of every Azurite server, which is published.
ACCOUNT = "devstoreaccount1"
KEY = "Eby8vdM02xNOcqFlqUwJPLlmEtlCDXJ1OUzFT50uSRZ6IFsuFq2UVErCz4I6tq/K1SZFPTOtr/KBHBeksoGMGw=="
AZURITE = "azurite@3"
CONTAINER = "pam-bench"


def server(port: int, log) -> tuple[subprocess.Popen, BlobServiceClient]:
    """The server, once it answers."""
    # Clients are newer than the server.
    command = ["npx", "--yes", "--package", AZURITE, "azurite-blob", "--blobPort", str(port), "--inMemoryPersistence", "--skipApiVersionCheck", "--silent"]
    process = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
    client = BlobServiceClient(f"http://127.0.0.1:{port}/{ACCOUNT}", credential=KEY, retry_total=0)
    for _ in range(1200):
        try:
            client.create_container(CONTAINER)
            return process, client
        except AzureError:
            assert process.poll() is None, "the Azure server ended"
            time.sleep(0.1)
    raise SystemExit("the Azure server does not answer")


def objects(container, prefix: str) -> dict[str, bytes]:
    names = [blob.name for blob in container.list_blobs(name_starts_with=prefix + "/")]
    return {name.removeprefix(prefix + "/"): container.download_blob(name).readall() for name in names}


def check(environment: dict, container) -> None:
    source, target = f"az://{CONTAINER}/fleet.csv", f"az://{CONTAINER}/results"
    whole = batch(environment, "fleet.csv", "whole")
    assert whole.returncode == 0, whole.stderr
    done = batch(environment, source, target)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert (said["computed"], said["failed"]) == (MUSCLES + 1, 1), said
    same(objects(container, "results"), files("whole"))
    again = json.loads(batch(environment, source, target).stdout)
    assert (again["reused"], again["computed"]) == (MUSCLES + 1, 0), again
    refused(batch(environment, "az://nowhere/fleet.csv", target), "there is no bucket az://nowhere", "create it")
    refused(batch(environment, source, "az://nowhere/results"), "there is no bucket az://nowhere", "create it")
    wrong = {"AZURE_STORAGE_ACCOUNT_KEY": KEY[:8] + ("A" if KEY[8] != "A" else "B") + KEY[9:]}
    refused(batch(environment | wrong, source, target), "refuses the credentials", "AZURE_STORAGE_ACCOUNT_KEY")
    closed = {"AZURE_STORAGE_ENDPOINT": f"http://127.0.0.1:{free_port()}/{ACCOUNT}"}
    refused(batch(environment | closed, source, target), "cannot be used", "AZURE_STORAGE_ENDPOINT")
    plain = {k: v for k, v in environment.items() if k != "AZURE_ALLOW_HTTP"}
    refused(batch(plain, source, target), "not encrypted", "AZURE_ALLOW_HTTP")


def main() -> None:
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        fleet()
        with open("server.log", "w") as log:
            process, client = server(port, log)
        try:
            container = client.get_container_client(CONTAINER)
            for path in [Path("fleet.csv"), *Path().glob("m*/*")]:
                container.upload_blob(path.as_posix(), path.read_bytes())
            environment = {k: v for k, v in os.environ.items() if not k.startswith("AZURE_")}
            environment |= {"AZURE_STORAGE_ACCOUNT_NAME": ACCOUNT, "AZURE_STORAGE_ACCOUNT_KEY": KEY, "NO_COLOR": "1",
                            "AZURE_STORAGE_ENDPOINT": f"http://127.0.0.1:{port}/{ACCOUNT}", "AZURE_ALLOW_HTTP": "true"}  # fmt: skip
            check(environment, container)
        finally:
            # The server is a child of npx.
            os.killpg(process.pid, 15)
            process.wait()
            os.chdir("/")
    print("fleet: batch from and into an Azure container, and its errors: passed")


if __name__ == "__main__":
    main()
