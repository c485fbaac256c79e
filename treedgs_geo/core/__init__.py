"""What every room uses: errors, settings, progress, workspaces, reference frames, safe files."""
