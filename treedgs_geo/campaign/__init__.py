"""Many plots: a manifest with one row a plot, run on Dask workers, each plot in a resumable workspace of its own.

One way: manifest -> plan (on disk) -> workers -> records (one a plot, on disk) -> one trees layer and one report. The
coordinator keeps counts and what is running now, never the plots: its memory does not grow with the campaign.
"""
