"""Questions to many scenes: responses, sweeps, maps, time histories, films."""
