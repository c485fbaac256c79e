"""Flight plans against what they get: clear views, share measured, standard errors, photos, seconds."""
