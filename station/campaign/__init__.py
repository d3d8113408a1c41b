"""Many lockstep flights: drawn from one seed, flown on all cores or a Dask cluster, resumable."""
