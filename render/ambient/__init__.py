"""The light of lamps and sky: path tracing with NEE and MIS."""
