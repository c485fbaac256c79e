"""Where stems may stand: edge voting, space carving, the network's seeds."""
