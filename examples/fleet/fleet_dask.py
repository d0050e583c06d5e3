"""The fleet on Dask: python fleet_dask.py MANIFEST FOLDER [SCHEDULER]

Without the address of a scheduler, a local cluster of processes is used.
"""

import sys

from dask.distributed import Client, as_completed

import job


def main(manifest, folder, scheduler=None):
    with Client(scheduler, dashboard_address=None) if scheduler else Client(threads_per_worker=1, dashboard_address=None) as client:
        # The module is sent along, so that workers need only the bindings.
        client.upload_file(job.__file__)
        futures = client.map(job.analyse, list(job.muscles(manifest)), pure=False)
        job.write(sorted((f.result() for f in as_completed(futures)), key=lambda r: r["muscle"]), folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
