"""The fleet on Ray: python fleet_ray.py MANIFEST FOLDER [ADDRESS]

Without the address of a cluster, Ray runs on this machine.
"""

import sys

import ray

import job


def main(manifest, folder, address=None):
    ray.init(address=address, include_dashboard=False, log_to_driver=False, runtime_env={"py_modules": [job]} if address else None)
    analyse = ray.remote(job.analyse)
    # A limited number of tasks at a time: the length of the manifest costs no memory.
    waiting, rows = [], []
    for item in job.muscles(manifest):
        waiting.append(analyse.remote(item))
        if len(waiting) >= 1000:
            done, waiting = ray.wait(waiting, num_returns=500)
            rows += ray.get(done)
    rows += ray.get(waiting)
    job.write(sorted(rows, key=lambda r: r["muscle"]), folder)
    ray.shutdown()


if __name__ == "__main__":
    main(*sys.argv[1:])
