"""What drillctl costs, beside its peers and beside the machine. `make bench`; see README.md."""
