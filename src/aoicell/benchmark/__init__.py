"""The benchmark: trials in prepared worlds, scored from truth, kept and summed up."""
