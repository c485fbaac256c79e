"""Many plots: a manifest with one row a plot, each plot an engine of its own in a resumable workspace of its own.

One way: manifest -> plan (on disk) -> engines, as many at once as memory and cores carry -> records (one a plot, on
disk) -> one trees layer and one report. Further computers that share the folder take plots as well: leases on disk say
who works on what.
"""
