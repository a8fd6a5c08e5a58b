"""Files looked at, checked, compared and begun: devices, scenes, runs, sweeps, studies, campaigns, records."""
