"""Sweeps beyond one machine: on Dask, on SLURM's arrays, and on those of any other scheduler, over one store."""
