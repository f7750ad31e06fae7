"""Work on arrays of samples: differentiate, decimate, resample, lags."""
